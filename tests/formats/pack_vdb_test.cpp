// The volume files as OpenVDB itself reads them.
#include <gtest/gtest.h>
#include <openvdb/io/File.h>
#include <openvdb/openvdb.h>

#include "formats/read_pack.h"
#include "tests/formats/write_test_util.h"

namespace texel::test {
namespace {

std::string level_name(int level) { return level == 0 ? "volume.vdb" : "volume_level_" + std::to_string(level) + ".vdb"; }

template <class GridType>
typename GridType::Ptr open_grid(const std::string& path, const std::string& name) {
  openvdb::initialize();
  openvdb::io::File file(path);
  file.open(false);
  return openvdb::gridPtrCast<GridType>(file.readGrid(name));
}

// Sum of value and of value · world position over the active voxels.
openvdb::Vec3d centroid(const openvdb::FloatGrid& grid, double* total = nullptr) {
  openvdb::Vec3d moment(0);
  double sum = 0;
  for (auto it = grid.cbeginValueOn(); it; ++it) {
    openvdb::CoordBBox box;
    it.getBoundingBox(box);
    const double weight = static_cast<double>(*it) * static_cast<double>(box.volume());
    moment += weight * grid.indexToWorld(box.getCenter());
    sum += weight;
  }
  if (total) *total = sum;
  return moment / sum;
}

Pack one_voxel(const V3i& at, float value) {
  Pack pack;
  pack.grid = {V3d(-3, 5, 0.5), 0.25, V3i(16, 16, 16)};
  Level level;
  level.grid = pack.grid;
  Layer layer = make_layer(level.grid.n, [&](int x, int y, int z) { return V3i(x, y, z) == at; });
  add_channel(layer, "density", 1, [&](int, int, int) { return V3f(value); });
  level.layers.push_back(std::move(layer));
  pack.levels.push_back(std::move(level));
  return pack;
}

TEST(PackVdb, PutsOneVoxelWhereTheGridSays) {
  const TempFolder folder;
  const V3i at(9, 2, 15);
  save(one_voxel(at, 0.75f), folder / "one");
  const auto grid = open_grid<openvdb::FloatGrid>(folder / "one/volume.vdb", "density");
  ASSERT_EQ(grid->activeVoxelCount(), 1u);
  const auto it = grid->cbeginValueOn();
  EXPECT_EQ(it.getCoord(), openvdb::Coord(at.x, at.y, at.z));
  EXPECT_EQ(*it, 0.75f);
  // Exact: all numbers are short binary fractions.
  const openvdb::Vec3d world = grid->indexToWorld(it.getCoord());
  EXPECT_EQ(world, openvdb::Vec3d(-3 + 9.5 * 0.25, 5 + 2.5 * 0.25, 0.5 + 15.5 * 0.25));
  EXPECT_EQ(grid->background(), 0);
}

TEST(PackVdb, KeepsTheBallInPlaceOnEveryLevel) {
  const TempFolder folder;
  const BallOptions o{.n = 64, .levels = 5, .centre = V3d(31.3, 30.9, 33.6), .radius = 20.25};
  save(ball_pack(o), folder / "half");
  save(ball_pack(o), folder / "float", {.full_float = true});
  const V3d centre = o.origin + o.centre * o.h;
  double volume = 0;
  for (int l = 0; l < o.levels; ++l)
    for (const bool full : {true, false}) {
      const auto grid = open_grid<openvdb::FloatGrid>(folder / (full ? "float/" : "half/") + level_name(l), "solid");
      double sum = 0;
      const openvdb::Vec3d c = centroid(*grid, &sum);
      const double h = o.h * (1 << l);
      // A mistake of half a voxel would be 0.5 h. What is left: 216 samples a voxel, and that a voxel's matter counts at its centre.
      EXPECT_LT((c - openvdb::Vec3d(centre.x, centre.y, centre.z)).length(), 0.01 * h) << "level " << l;
      EXPECT_DOUBLE_EQ(grid->voxelSize().x(), h);
      if (l == 0 && full) volume = sum * h * h * h;
      // Half a storage step of each value is the most the sum can be off.
      EXPECT_NEAR(sum * h * h * h, volume, volume * (full ? 0x1p-20 : 0x1p-11)) << "level " << l;
      // The outer walls of all levels coincide: the low corner of cell 0.
      EXPECT_EQ(grid->indexToWorld(openvdb::Vec3d(-0.5)), openvdb::Vec3d(o.origin.x, o.origin.y, o.origin.z));
    }
}

TEST(PackVdb, StatesClassTypesAndMeaning) {
  const TempFolder folder;
  save(ball_pack({.levels = 1}), folder / "ball");
  openvdb::initialize();
  openvdb::io::File file(folder / "ball/volume.vdb");
  file.open(false);
  EXPECT_EQ(file.compression(), openvdb::io::COMPRESS_BLOSC | openvdb::io::COMPRESS_ACTIVE_MASK);
  const auto grids = file.getGrids();
  ASSERT_EQ(grids->size(), 9u);
  for (const auto& grid : *grids) {
    const std::string name = grid->getName();
    EXPECT_EQ(grid->getGridClass(), openvdb::GRID_FOG_VOLUME) << name;
    EXPECT_TRUE(grid->saveFloatAsHalf()) << name;
    EXPECT_EQ(grid->metaValue<double>("voxel_edge"), 0.125) << name;
    EXPECT_FALSE(grid->metaValue<std::string>("units").empty()) << name;
    EXPECT_FALSE(grid->metaValue<std::string>("meaning").empty()) << name;
    if (grid->isType<openvdb::Vec3SGrid>())
      EXPECT_EQ(grid->getVectorType(), name == "normal" ? openvdb::VEC_COVARIANT_NORMALIZE : openvdb::VEC_INVARIANT) << name;
    else
      EXPECT_TRUE(grid->isType<openvdb::FloatGrid>()) << name;
  }
}

TEST(PackVdb, RoundsHalvesToNearestAndKeepsFloats) {
  const TempFolder folder;
  for (const float value : {1.0f + 0x1p-11f + 0x1p-20f, 0.1f, 65504.0f, 3.0f * 0x1p-24f}) {
    save(one_voxel({3, 3, 3}, value), folder / "half");
    save(one_voxel({3, 3, 3}, value), folder / "float", {.full_float = true});
    const auto half = open_grid<openvdb::FloatGrid>(folder / "half/volume.vdb", "density");
    const auto full = open_grid<openvdb::FloatGrid>(folder / "float/volume.vdb", "density");
    // Exact: Imath's conversion rounds to nearest, and floats are not touched.
    EXPECT_EQ(half->tree().getValue(openvdb::Coord(3)), static_cast<float>(Imath::half(value)));
    EXPECT_EQ(full->tree().getValue(openvdb::Coord(3)), value);
    EXPECT_TRUE(half->saveFloatAsHalf());
    EXPECT_FALSE(full->saveFloatAsHalf());
  }
  // Vectors go through another converter of the library.
  Pack pack = one_voxel({3, 3, 3}, 1);
  const V3f value(0.1f, 1.0f + 0x1p-11f + 0x1p-20f, 0.7f);
  add_channel(pack.levels[0].layers[0], "Cd", 3, [&](int, int, int) { return value; });
  save(pack, folder / "vector");
  const auto read = open_grid<openvdb::Vec3SGrid>(folder / "vector/volume.vdb", "Cd")->tree().getValue(openvdb::Coord(3));
  for (int c = 0; c < 3; ++c) EXPECT_EQ(read[c], static_cast<float>(Imath::half(value[c])));
}

TEST(PackVdb, StoresAsFloatWhatHalfCannotHold) {
  const TempFolder folder;
  save(one_voxel({0, 0, 0}, 1e6f), folder / "big");  // would be infinity
  const auto grid = open_grid<openvdb::FloatGrid>(folder / "big/volume.vdb", "density");
  EXPECT_EQ(grid->tree().getValue(openvdb::Coord(0)), 1e6f);
  EXPECT_TRUE(check_pack(folder / "big").empty());
  Pack pack = one_voxel({0, 0, 0}, 1e-7f);
  pack.levels[0].layers[0].channels[0].full_float = true;
  save(pack, folder / "small");
  EXPECT_EQ(open_grid<openvdb::FloatGrid>(folder / "small/volume.vdb", "density")->tree().getValue(openvdb::Coord(0)), 1e-7f);
}

TEST(PackVdb, KeepsTilesAsTiles) {
  const TempFolder folder;
  const Pack pack = ball_pack({.n = 64, .levels = 2});
  const Layer& matter = pack.levels[0].layers[0];
  ASSERT_GT(matter.tiles.size(), 10u);
  save(pack, folder / "ball");
  const auto grid = open_grid<openvdb::FloatGrid>(folder / "ball/volume.vdb", "solid");
  EXPECT_EQ(grid->tree().activeTileCount(), matter.tiles.size());
  EXPECT_EQ(grid->activeVoxelCount(), static_cast<std::uint64_t>(matter.set.count) + 512 * matter.tiles.size());
  EXPECT_EQ(grid->tree().leafCount(), matter.set.blocks.size());
  const Pack back = read_pack(folder / "ball");
  EXPECT_EQ(back.levels[0].layers[0].tiles, matter.tiles);
}

TEST(PackVdb, WritesWholeTiledCubeOf128) {
  // 16³ tiles fill an internal node of OpenVDB: they must not be merged or lost.
  const TempFolder folder;
  Pack pack;
  pack.grid = {V3d(0), 1, V3i(128, 128, 128)};
  Level level;
  level.grid = pack.grid;
  Layer layer = make_layer(level.grid.n, {}, [](int, int, int) { return true; });
  add_channel(layer, "density", 1, [](int, int, int) { return V3f(2); });
  level.layers.push_back(std::move(layer));
  pack.levels.push_back(std::move(level));
  save(pack, folder / "cube");
  EXPECT_EQ(open_grid<openvdb::FloatGrid>(folder / "cube/volume.vdb", "density")->activeVoxelCount(), 128u * 128 * 128);
  EXPECT_EQ(read_pack(folder / "cube").levels[0].layers[0].tiles.size(), 4096u);
  EXPECT_TRUE(check_pack(folder / "cube").empty());
}

TEST(PackVdb, WritesGridsWithoutVoxels) {
  const TempFolder folder;
  Pack pack = one_voxel({-1, -1, -1}, 1);
  ASSERT_EQ(pack.levels[0].layers[0].set.count, 0);
  pack.levels[0].layers.emplace_back();  // a layer without channels is left out
  save(pack, folder / "empty");
  EXPECT_EQ(open_grid<openvdb::FloatGrid>(folder / "empty/volume.vdb", "density")->activeVoxelCount(), 0u);
  const Pack back = read_pack(folder / "empty");
  ASSERT_EQ(back.levels[0].layers.size(), 1u);
  EXPECT_EQ(back.levels[0].layers[0].set.count, 0);
  EXPECT_TRUE(check_pack(folder / "empty").empty());
}

TEST(PackVdb, ReadsBackWhatWasWritten) {
  const TempFolder folder;
  const Pack pack = ball_pack({.n = 40});
  save(pack, folder / "ball", {.full_float = true});
  const Pack back = read_pack(folder / "ball");
  ASSERT_EQ(back.levels.size(), pack.levels.size());
  for (std::size_t l = 0; l < pack.levels.size(); ++l) {
    const Level &a = pack.levels[l], &b = back.levels[l];
    EXPECT_EQ(a.grid.n, b.grid.n);
    EXPECT_EQ(a.grid.h, b.grid.h);
    EXPECT_EQ(a.grid.origin, b.grid.origin);
    for (const Layer& layer : a.layers)
      for (const Channel& c : layer.channels) {
        const Layer* found = nullptr;
        const Channel* read = b.find(c.name, &found);
        ASSERT_NE(read, nullptr) << c.name;
        EXPECT_EQ(read->values, c.values) << c.name;  // exact: stored as floats
        EXPECT_EQ(read->tiles, c.tiles) << c.name;
        EXPECT_EQ(found->tiles, layer.tiles);
        ASSERT_EQ(found->set.blocks.size(), layer.set.blocks.size());
        for (std::size_t i = 0; i < layer.set.blocks.size(); ++i) {
          EXPECT_EQ(found->set.blocks[i].at, layer.set.blocks[i].at);
          EXPECT_EQ(found->set.blocks[i].mask, layer.set.blocks[i].mask);
          EXPECT_EQ(found->set.blocks[i].first, layer.set.blocks[i].first);
        }
      }
  }
  // Channels that share their voxels share a layer again.
  EXPECT_EQ(back.levels[0].layers.size(), 3u);
}

// zip for Blosc: the same grids to the bit, said so in the file, in fewer bytes.
TEST(PackVdb, ZipHoldsTheSame) {
  const TempFolder folder;
  const Pack pack = ball_pack({.n = 48, .levels = 2, .slices = false});
  save(pack, folder / "blosc");
  save(pack, folder / "zip", {.codec = VolumeCodec::kZip});
  for (int l = 0; l < 2; ++l) {
    const std::string blosc = folder / ("blosc/" + level_name(l)), zip = folder / ("zip/" + level_name(l));
    EXPECT_LT(fs::file_size(zip), fs::file_size(blosc));
    const auto a = open_grid<openvdb::Vec3SGrid>(blosc, "alpha"), b = open_grid<openvdb::Vec3SGrid>(zip, "alpha");
    EXPECT_TRUE(a->tree().hasSameTopology(b->tree()));
    for (auto it = a->cbeginValueOn(); it; ++it) ASSERT_EQ(*it, b->tree().getValue(it.getCoord()));
    EXPECT_EQ(b->metaValue<std::string>(openvdb::GridBase::META_FILE_COMPRESSION), "zip + active values");
  }
  EXPECT_TRUE(check_pack(folder / "zip").empty());
}

}  // namespace
}  // namespace texel::test
