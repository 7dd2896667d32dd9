// Pruned and rounded packs against the same packs as they were: what is said to hold of every value, column and sum does.
#include <gtest/gtest.h>

#include <Imath/half.h>

#include "bake/compare_voxels.h"
#include "bake/ndf.h"
#include "bake/prune.h"
#include "bake/round_values.h"
#include "bake/view_voxels.h"
#include "formats/hypertexture.h"
#include "formats/read_pack.h"
#include "tests/bake/bake_util.h"
#include "tests/formats/write_test_util.h"

namespace texel::test {
namespace {

// 20 000 values of each grid as bakes make them, and the ends of their ranges.
Level random_level(std::uint64_t seed, int side = 32) {
  Random random(seed);
  Level level;
  level.grid = {V3d(0, 0, 0), 0.5, V3i(side, side, side)};
  Layer layer = make_layer(level.grid.n, [&](int, int, int) { return random.uniform() < 0.6; });
  const auto share = [&] {
    const double u = random.uniform();
    return u < 0.1 ? 0 : u < 0.2 ? 1 : u < 0.3 ? std::pow(10, random.uniform(-7, -1)) : u < 0.4 ? 1 - std::pow(10, random.uniform(-7, -1)) : random.uniform();
  };
  const auto amount = [&] { return random.uniform() < 0.1 ? 0 : std::pow(10, random.uniform(-6, 2)); };
  const auto three = [](auto& one) { return [&one](int, int, int) { const double x = one(), y = one(); return V3f(V3d(x, y, one())); }; };
  for (const char* name : {"solid", "coverage", "roughness", "transparency"}) add_channel(layer, name, 1, [&](int, int, int) { return V3f(static_cast<float>(share())); });
  add_channel(layer, "alpha", 3, three(share));
  add_channel(layer, "Cd", 3, three(share));
  for (const char* name : {"density", "area"}) add_channel(layer, name, 1, [&](int, int, int) { return V3f(static_cast<float>(amount())); });
  for (const char* name : {"crossings", "emission"}) add_channel(layer, name, 3, three(amount));
  add_channel(layer, "normal", 3, [&](int, int, int) {
    const V3d n = random.direction();
    return V3f(random.uniform() < 0.5 ? n : n * random.uniform());
  });
  // S of sheets, fibres and all between, turned anyhow: those of no thickness are where rounding makes eigenvalues negative.
  std::vector<Symmetric> s;
  for (std::int64_t i = 0; i < layer.set.count; ++i) {
    Moments m;
    const int facets = 1 + static_cast<int>(random.uniform() * 4);
    const V3d axis = random.direction();
    for (int f = 0; f < facets; ++f) {
      V3d n = random.direction();
      if (i % 3 == 0) n = (n - axis * n.dot(axis)).normalized();
      const double a = random.uniform(0.01, 1);
      m.add(n, a, true);
    }
    s.push_back(i % 17 == 0 ? Symmetric{} : sggx(m));
  }
  std::size_t i = 0;
  add_channel(layer, "S_diag", 3, [&](int, int, int) { const Symmetric& m = s[i++]; return V3f(V3d(m.xx, m.yy, m.zz)); });
  i = 0;
  add_channel(layer, "S_off", 3, [&](int, int, int) { const Symmetric& m = s[i++]; return V3f(V3d(m.xy, m.xz, m.yz)); });
  level.layers.push_back(std::move(layer));
  return level;
}

constexpr double kFloat = 1.2e-7;  // a result's rounding to float, in parts of it

TEST(RoundValues, EveryGridKeepsToItsBound) {
  for (const double error : {0.0005, 0.001, 1.0 / 256, 0.004, 0.013, 0.0625}) {
    const Level before = random_level(7);
    std::vector<Level> after{before};
    const std::vector<GridErrors> told = round_levels(after, error);
    for (const Channel& c : before.layers[0].channels) {
      const Channel& r = *after[0].find(c.name);
      const Norm norm = norm_of(c.name);
      double most = 0, square = 0;
      std::int64_t bad = 0, changed = 0;
      for (std::size_t i = 0; i < c.values.size(); ++i) {
        const double v = static_cast<double>(c.values[i]), q = static_cast<double>(r.values[i]), e = difference(norm, v, q);
        most = std::max(most, e);
        square += e * e;
        changed += v != q;
        bad += (v == 0) != (q == 0) && c.name[0] != 'S' && c.name != "normal";
        if (norm == Norm::kShare) bad += (v == 1) != (q == 1);
        if (c.name == "alpha") bad += std::abs(q - v) > 4 * error * std::min(v, 1 - v) + kFloat;  // faint and nearly opaque voxels
      }
      EXPECT_EQ(bad, 0) << c.name << " " << error;
      EXPECT_LE(most, error * (1 + 1e-6) + kFloat) << c.name << " " << error;
      EXPECT_GT(changed, static_cast<std::int64_t>(c.values.size() / 4)) << c.name;
      // What is told is what is there; sums in another order.
      const auto g = std::find_if(told.begin(), told.end(), [&](const GridErrors& t) { return t.grid == c.name; });
      ASSERT_NE(g, told.end()) << c.name;
      EXPECT_NEAR(g->errors.most, most, kFloat) << c.name;
      EXPECT_NEAR(g->errors.square, square, 1e-3 * square) << c.name;
    }
  }
}

TEST(RoundValues, HalvesHoldWhatComesOut) {
  // Shares next to 1 aside: halves are 2^-11 apart there, and the step is finer from a distance of 1/32 on (4 x 0.004 / 2 x 1/64 < 2^-11).
  std::vector<Level> levels{random_level(11)};
  (void)round_levels(levels, 0.004);
  for (const Channel& c : levels[0].layers[0].channels)
    for (const float v : c.values)
      if (std::abs(v) >= 6.2e-5f && !(norm_of(c.name) == Norm::kShare && v > 1 - 1.0f / 32)) {
        ASSERT_EQ(static_cast<float>(Imath::half(v)), v) << c.name;
      }
}

TEST(RoundValues, MatricesStayPositiveAndNormalsShort) {
  for (const double error : {0.0005, 0.004, 0.0625}) {
    std::vector<Level> levels{random_level(13)};
    (void)round_levels(levels, error);
    const std::vector<float>&d = levels[0].find("S_diag")->values, &o = levels[0].find("S_off")->values, &n = levels[0].find("normal")->values;
    double least = 0, largest = 0, length = 0;
    for (std::size_t i = 0; i < d.size(); i += 3) {
      const auto at = [](const std::vector<float>& v, std::size_t k) { return static_cast<double>(v[k]); };
      const Eigen3 e = eigen({.xx = at(d, i), .yy = at(d, i + 1), .zz = at(d, i + 2), .xy = at(o, i), .xz = at(o, i + 1), .yz = at(o, i + 2)});
      least = std::min(least, e.value[2]);
      if (e.value[0] > 0) largest = std::max(largest, std::abs(e.value[0] - 1));
      length = std::max(length, V3d(at(n, i), at(n, i + 1), at(n, i + 2)).length());
    }
    EXPECT_GE(least, -2e-9);        // the eigenvalues' own rounding
    EXPECT_LE(largest, 1.5 * error + kFloat);
    EXPECT_LE(length, 1 + kFloat);  // as given
  }
}

// A wall of one value a voxel is what rounding each by itself would get wrong as a whole.
TEST(RoundValues, SumsKeepToHalfAStep) {
  for (const double value : {0.70710678, 0.3, 0.013, 1.4142, 33.3}) {
    Level level;
    level.grid = {V3d(0, 0, 0), 1, V3i(32, 32, 32)};
    Layer layer = make_layer(level.grid.n, [](int, int, int z) { return z == 11; });
    add_channel(layer, "area", 1, [&](int, int, int) { return V3f(static_cast<float>(value)); });
    add_channel(layer, "solid", 1, [&](int, int, int) { return V3f(static_cast<float>(std::min(1.0, value))); });
    level.layers.push_back(layer);
    std::vector<Level> levels{level};
    const double error = 0.01;
    (void)round_levels(levels, error);
    EXPECT_NE(levels[0].find("area")->values, level.find("area")->values);
    // Half a step, itself `error` at most in parts of values above 1; sums of 1024 floats round in double.
    for (const char* grid : {"area", "solid"}) EXPECT_NEAR(sum_of(levels[0], grid), sum_of(level, grid), 0.5 * error * std::max(1.0, value) + 1e-9) << grid << " " << value;
  }
}

// Faint voxels of one opacity are all off to the same side. Light through n of them is off by n a (1 - a)^(n - 1) parts of 4 errors, 1.69 errors at most
// to first order; second order adds an error's square.
TEST(RoundValues, LongColumnsStayRight) {
  const double error = 0.004;
  double worst = 0;
  for (const double alpha : {1e-4, 0.001, 0.0031, 0.0123, 0.05, 0.1249, 0.2499, 0.2501, 0.31, 0.5, 0.77}) {
    std::vector<Level> levels(1);
    levels[0].grid = {V3d(0, 0, 0), 1, V3i(8, 8, 8)};
    levels[0].layers.push_back(make_layer(levels[0].grid.n, [](int x, int y, int z) { return x + y + z == 0; }));
    add_channel(levels[0].layers[0], "alpha", 3, [&](int, int, int) { return V3f(static_cast<float>(alpha)); });
    (void)round_levels(levels, error);
    const double rounded = static_cast<double>(levels[0].find("alpha")->values[0]);
    for (int n = 1; n < 100000; n += 1 + n / 4) worst = std::max(worst, std::abs(std::pow(1 - rounded, n) - std::pow(1 - alpha, n)));
  }
  EXPECT_LE(worst, 1.7 * error + 16 * error * error);
  EXPECT_GT(worst, 0.2 * error);
}

// A ball in a glass one, a slanted sheet, a card with much of its area in few voxels: matter, open and transparent surface, two roughnesses.
Scene mixed_scene() {
  Scene scene = empty_scene();
  scene.materials[0].kd = V3f(0.8f, 0.1f, 0.1f);
  scene.materials.resize(3);
  scene.materials[1].kd = V3f(0.1f, 0.2f, 0.9f);
  scene.materials[1].opacity = 0.3f;
  scene.materials[1].ks = V3f(0.04f, 0.04f, 0.04f);
  scene.materials[2].kd = V3f(0.2f, 0.7f, 0.1f);
  scene.materials[2].roughness = 0.5f;
  add_ball(scene, 0.6, 32, 0);
  add_ball(scene, 1, 48, 1);
  add_quad(scene, V3d(-1.1, -1.0, -0.9), V3d(2.2, 0.1, 0.3), V3d(0.2, 2.0, 1.5), 2);
  return scene;
}
struct Case { const char* name; Scene scene; Recipe recipe; };
std::vector<Case> cases() {
  std::vector<Case> all;
  all.push_back({"mixed", mixed_scene(), volume_recipe(48)});
  all.push_back({"filtered", mixed_scene(), volume_recipe(48)});
  all.back().recipe.level_mode = LevelMode::kFilter;
  all.push_back({"opacity alone", mixed_scene(), volume_recipe(40)});
  all.back().recipe.want = {.slices = false, .density = false, .color = false, .ndf = false, .visibility = true, .material = false, .normal = false, .levels = true, .preview = false};
  all.push_back({"density alone", mixed_scene(), volume_recipe(40)});
  all.back().recipe.want = {.slices = false, .density = true, .color = true, .ndf = false, .visibility = false, .material = false, .normal = false, .levels = true, .preview = false};
  all.push_back({"cyclic", mixed_scene(), volume_recipe(32)});
  all.back().recipe.box = Box3d(V3d(-0.9, -0.9, -0.9), V3d(0.9, 0.9, 0.9));
  all.back().recipe.cyclic = {true, true, false};
  all.push_back({"two lobes", mixed_scene(), volume_recipe(40)});
  all.back().recipe.lobes = 2;
  all.push_back({"fog", density_preset("fog"), volume_recipe(32)});
  all.push_back({"fire", density_preset("fire"), volume_recipe(32)});
  all.push_back({"one colour", empty_scene(), volume_recipe(50)});
  add_ball(all.back().scene, 1, 48);
  return all;
}

// How much light passes each column of a level, by its opacity or its density.
std::vector<double> columns_of(const Level& level, int axis) {
  if (level.find("alpha")) return column_transmittance(VoxelField(level, "alpha", 3), level.grid.n, axis);
  const VoxelField density(level, "density", 1);
  const V3i n = level.grid.n;
  const int u = axis == 0 ? 1 : 0, v = axis == 2 ? 1 : 2;
  std::vector<double> through(static_cast<std::size_t>(n[u]) * static_cast<std::size_t>(n[v]), 1);
  for_each_active(density, n, [&](const V3i& p, const float* d) {
    through[static_cast<std::size_t>(p[v]) * static_cast<std::size_t>(n[u]) + static_cast<std::size_t>(p[u])] *= std::exp(-level.grid.h * static_cast<double>(*d));
  });
  return through;
}

TEST(Prune, KeepsToItsTolerance) {
  std::int64_t faint = 0, tiles = 0, background = 0;
  for (const Case& c : cases()) {
    const Pack whole = bake_quietly(c.scene, c.recipe);
    for (const double tolerance : {0.002, 0.02, 0.1}) {
      SCOPED_TRACE(std::string(c.name) + " " + std::to_string(tolerance));
      Pack pruned = whole;
      const Pruned told = prune_levels(pruned.levels, tolerance);
      check_invariants(pruned);
      faint += told.voxels;
      tiles += told.tiles;
      background += told.background;
      EXPECT_TRUE(told.judged);
      EXPECT_LE(told.column, tolerance);
      EXPECT_LE(told.area, tolerance);
      EXPECT_LE(told.volume, tolerance);
      double area = 0, volume = 0;
      for (std::size_t l = 0; l < whole.levels.size(); ++l) {
        const Level &a = pruned.levels[l], &b = whole.levels[l];
        for (int axis = 0; axis < 3; ++axis) {
          const std::vector<double> x = columns_of(a, axis), y = columns_of(b, axis);
          double worst = 0;
          for (std::size_t i = 0; i < x.size(); ++i) worst = std::max(worst, std::abs(x[i] - y[i]));
          // What is left out, and what tiles are off: 1.1 of the tolerance covers that part's second order.
          EXPECT_LE(worst, told.column + 1.1 * tolerance * (told.tiles > 0)) << "level " << l << " axis " << axis;
        }
        for (const Layer& layer : b.layers)
          for (const Channel& channel : layer.channels) {
            const VoxelField is(a, channel.name, channel.components), was(b, channel.name, channel.components);
            ASSERT_TRUE(is.present()) << channel.name;
            const bool zero = channel.name == "solid" || channel.name == "ks" || channel.name == "transparency" || channel.name == "emission";
            const Norm norm = norm_of(channel.name);
            const char* judge = b.find("alpha") ? "alpha" : "density";
            const VoxelField kept(a, judge, judge[0] == 'a' ? 3 : 1);
            std::int64_t lost = 0, off = 0;
            for_each_active(was, b.grid.n, [&](const V3i& v, const float* w) {
              const float* i = is.at(v);
              const bool left_out = !kept.at(v);
              if (!i && !left_out && !zero) ++lost;
              if (left_out && !i) return;
              for (int k = 0; k < channel.components; ++k) off += difference(norm, static_cast<double>(w[k]), i ? static_cast<double>(i[k]) : 0) > tolerance * (1 + 1e-6) + kFloat;
            });
            EXPECT_EQ(lost, 0) << channel.name << " level " << l;
            EXPECT_EQ(off, 0) << channel.name << " level " << l;
          }
        if (b.find("area")) area = std::max(area, 1 - sum_of(a, "area") / sum_of(b, "area"));
        if (b.find("solid") && sum_of(b, "solid") > 0) volume = std::max(volume, std::abs(1 - sum_of(a, "solid") / sum_of(b, "solid")));
      }
      EXPECT_NEAR(area, told.area, 1e-6);
      EXPECT_NEAR(volume, told.volume, 1e-6);
    }
  }
  EXPECT_GT(faint, 1000);
  EXPECT_GT(tiles, 1000);
  EXPECT_GT(background, 1000);
}

// A slab of one faint opacity, of which each column may lose as many voxels as the tolerance holds: no more, and no fewer.
TEST(Prune, SpendsWhatAColumnMayLose) {
  Level level;
  level.grid = {V3d(0, 0, 0), 1, V3i(64, 64, 64)};
  Layer layer = make_layer(level.grid.n, [](int, int, int) { return true; });
  add_channel(layer, "alpha", 3, [](int x, int y, int z) { return (x + y + z) % 8 == 0 ? V3f(0.002f) : V3f(0.5f + 0.001f * static_cast<float>(x)); });
  level.layers.push_back(layer);
  std::vector<Level> levels{level};
  const Pruned told = prune_levels(levels, 0.0101);  // five of the eight in each column
  EXPECT_LE(told.column, 0.0101);
  EXPECT_GT(told.column, 0.0099);
  const VoxelField alpha(levels[0], "alpha", 3);
  std::int64_t gone = 0;
  for (int axis = 0; axis < 3; ++axis)
    for (int u = 0; u < 64; ++u)
      for (int v = 0; v < 64; ++v) {
        int out = 0;
        for (int w = 0; w < 64; ++w) {
          V3i p;
          p[axis] = w; p[(axis + 1) % 3] = u; p[(axis + 2) % 3] = v;
          if (!alpha.at(p)) { ++out; EXPECT_EQ((p.x + p.y + p.z) % 8, 0); }
        }
        EXPECT_LE(out, 5);
        gone += out;
      }
  EXPECT_EQ(gone, 3 * told.voxels);
  EXPECT_GT(told.voxels, 64 * 64 * 3);
}

TEST(Prune, OneColourIsAllTiles) {
  Scene scene = empty_scene();
  add_ball(scene, 1, 48);
  const Pack whole = bake_quietly(scene, volume_recipe(60));
  Recipe recipe = volume_recipe(60);
  recipe.prune = 0.001;
  const Pack pruned = bake_quietly(scene, recipe);
  for (std::size_t l = 0; l < pruned.levels.size(); ++l) {
    const Layer *is = nullptr, *was = nullptr;
    ASSERT_TRUE(pruned.levels[l].find("Cd", &is) && whole.levels[l].find("Cd", &was));
    EXPECT_EQ(is->set.count, 0) << l;
    EXPECT_EQ(is->tiles.size(), was->set.blocks.size() + was->tiles.size()) << l;
  }
}

TEST(Prune, NothingToJudgeByIsSaid) {
  Recipe recipe = volume_recipe(24);
  recipe.want = {.slices = false, .density = false, .color = false, .ndf = true, .visibility = false, .material = false, .normal = false, .levels = true, .preview = false};
  recipe.prune = 0.1;
  const Pack pack = bake_quietly(mixed_scene(), recipe);
  EXPECT_TRUE(std::any_of(pack.skipped.begin(), pack.skipped.end(), [](const Skip& s) { return s.what == "pruning of faint voxels"; }));
  recipe.prune = 0;
  EXPECT_EQ(sum_of(pack.levels[0], "area"), sum_of(bake_quietly(mixed_scene(), recipe).levels[0], "area"));
}

TEST(Packed, CheckIsContent) {
  const TempFolder folder;
  int number = 0;
  for (const Case& c : cases())
    for (const auto& [prune, quantize] : {std::pair{0.01, 0.0}, {0.0, 0.004}, {0.02, 0.01}, {0.25, 0.0625}}) {
      Recipe recipe = c.recipe;
      recipe.prune = prune;
      recipe.quantize = quantize;
      Pack pack = bake_quietly(c.scene, recipe);
      pack.recipe_json = "{\"prune\": " + std::to_string(prune) + ", \"quantize\": " + std::to_string(quantize) + "}";
      const std::string path = folder / std::to_string(number++);
      save(pack, path, {.codec = number % 2 ? VolumeCodec::kZip : VolumeCodec::kBlosc});
      for (const CheckFinding& f : check_pack(path)) ADD_FAILURE() << c.name << " " << prune << " " << quantize << ": " << f.id << " " << f.file << " " << f.text;
    }
}

// What is beyond what the recipe allows is still found.
TEST(Packed, CheckFindsMoreThanIsAllowed) {
  const TempFolder folder;
  Recipe recipe = volume_recipe(32);
  recipe.prune = 0.01;
  recipe.quantize = 0.004;
  recipe.lobes = 2;
  Pack pack = bake_quietly(mixed_scene(), recipe);
  pack.recipe_json = R"({"prune": 0.01, "quantize": 0.004})";
  const auto ids = [&](const std::string& grid, float factor) {
    Pack bad = pack;
    for (Layer& layer : bad.levels[1].layers)
      for (Channel& c : layer.channels)
        if (c.name == grid)
          for (float& v : c.values) v *= factor;
    const std::string path = folder / (grid + std::to_string(factor));
    save(bad, path);
    std::string all;
    for (const CheckFinding& f : check_pack(path)) all += f.id + " ";
    return all;
  };
  EXPECT_EQ(ids("area", 1), "");
  EXPECT_EQ(ids("area", 0.97f), "pack-levels-area ");
  EXPECT_EQ(ids("S_diag", 0.98f).substr(0, 15), "pack-sggx-range");
  EXPECT_EQ(ids("S1_diag", 0.98f).substr(0, 15), "pack-sggx-range");
  EXPECT_EQ(ids("S2_diag", 0.98f), "pack-sggx-range ");
  EXPECT_EQ(ids("share_1", 0.7f).substr(0, 32), "pack-value-range pack-sggx-range");  // below a half; 0.7 where the second lobe is 0
  EXPECT_EQ(ids("crossings", 0.9f), "pack-alpha-crossings ");
}

TEST(Packed, ThreadsAndSlabsChangeNothing) {
  Recipe recipe = volume_recipe(150);
  recipe.prune = 0.01;
  recipe.quantize = 0.004;
  std::vector<Pack> packs;
  for (const auto& [threads, memory] : {std::pair{1, std::int64_t{64} << 30}, {4, std::int64_t{64} << 30}, {0, std::int64_t{1}}}) {
    recipe.threads = threads;
    recipe.memory = memory;
    packs.push_back(bake_quietly(mixed_scene(), recipe));
  }
  for (std::size_t p = 1; p < packs.size(); ++p) {
    ASSERT_EQ(packs[p].levels.size(), packs[0].levels.size());
    for (std::size_t l = 0; l < packs[0].levels.size(); ++l) {
      ASSERT_EQ(packs[p].levels[l].layers.size(), packs[0].levels[l].layers.size());
      for (std::size_t i = 0; i < packs[0].levels[l].layers.size(); ++i) {
        const Layer &a = packs[p].levels[l].layers[i], &b = packs[0].levels[l].layers[i];
        ASSERT_EQ(a.set.count, b.set.count);
        ASSERT_EQ(a.tiles, b.tiles);
        for (std::size_t k = 0; k < b.set.blocks.size(); ++k) ASSERT_TRUE(a.set.blocks[k].at == b.set.blocks[k].at && a.set.blocks[k].mask == b.set.blocks[k].mask);
        for (std::size_t c = 0; c < b.channels.size(); ++c) {
          EXPECT_EQ(a.channels[c].name, b.channels[c].name);
          EXPECT_EQ(a.channels[c].values, b.channels[c].values) << b.channels[c].name;
          EXPECT_EQ(a.channels[c].tiles, b.channels[c].tiles) << b.channels[c].name;
        }
      }
    }
    ASSERT_EQ(packs[p].errors.size(), packs[0].errors.size());
    for (std::size_t e = 0; e < packs[0].errors.size(); ++e) EXPECT_EQ(packs[p].errors[e].value, packs[0].errors[e].value) << packs[0].errors[e].measure;
  }
}

}  // namespace
}  // namespace texel::test
