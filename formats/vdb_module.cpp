// texel_vdb.so: the only file that knows OpenVDB.
#include "formats/vdb_module.h"

#include <openvdb/io/Archive.h>
#include <openvdb/io/Compression.h>
#include <openvdb/io/DelayedLoadMetadata.h>
#include <openvdb/io/File.h>
#include <openvdb/io/GridDescriptor.h>
#include <openvdb/openvdb.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <fstream>
#include <limits>
#include <mutex>
#include <sstream>
#include <stdexcept>
#include <tuple>
#include <type_traits>
#include <unordered_map>

namespace texel {
namespace {

constexpr const char* kCreator = "texel";

// What a grid means, for whoever opens the file without our documents. Unknown names get no text.
struct Meaning {
  const char* name;
  const char* units;
  const char* text;
};
constexpr Meaning kMeanings[] = {
    {"density", "1 / world unit", "isotropic extinction: mean over the axes of -ln(1 - alpha) / voxel edge, capped"},
    {"Cd", "1", "linear RGB albedo, not premultiplied, running on beyond the matter"},
    {"alpha", "1", "opacity of the voxel seen along x, y, z"},
    {"area", "voxel edge^2", "surface area in the voxel, before cut-outs"},
    {"coverage", "1", "share of the area left after cut-outs"},
    {"normal", "1", "area-weighted mean normal, not of unit length"},
    {"S_diag", "1", "SGGX matrix, largest eigenvalue 1: xx, yy, zz"},
    {"S_off", "1", "SGGX matrix: xy, xz, yz"},
    {"S1_diag", "1", "SGGX matrix of the first lobe of normals, largest eigenvalue 1: xx, yy, zz"},
    {"S1_off", "1", "SGGX matrix of the first lobe: xy, xz, yz"},
    {"S2_diag", "1", "SGGX matrix of the second lobe, 0 where there is none: xx, yy, zz"},
    {"S2_off", "1", "SGGX matrix of the second lobe: xy, xz, yz"},
    {"share_1", "1", "share of the covered area that the first lobe has, 1 where it is the only one"},
    {"axis_1", "1", "first stored axis of the normal distribution"},
    {"axis_2", "1", "second stored axis of the normal distribution"},
    {"crossings", "1", "mean number of surface crossings along x, y, z"},
    {"kd", "1", "diffuse albedo"},
    {"ks", "1", "specular albedo"},
    {"roughness", "1", "GGX alpha"},
    {"transparency", "1", "share of light the material lets through"},
    {"emission", "radiance", "emitted light"},
    {"solid", "1", "share of the voxel inside closed components"},
};

const Meaning* meaning_of(const std::string& name) {
  const auto* found = std::find_if(std::begin(kMeanings), std::end(kMeanings), [&](const Meaning& m) { return name == m.name; });
  return found == std::end(kMeanings) ? nullptr : found;
}

// OpenVDB's file class writes to a path and does not look at the stream afterwards; the base class writes to any stream.
struct SeekableArchive : openvdb::io::Archive {
  void write_grids(std::ostream& out, const openvdb::GridCPtrVec& grids, const openvdb::MetaMap& meta) const {
    Archive::write(out, grids, /*seekable=*/true, meta);
  }
};

template <class Value>
Value value_at(const std::vector<float>& values, std::size_t i) {
  if constexpr (std::is_same_v<Value, float>) {
    return values[i];
  } else {
    return Value(values[3 * i], values[3 * i + 1], values[3 * i + 2]);
  }
}

template <class Value>
void append(std::vector<float>& values, const Value& v) {
  if constexpr (std::is_same_v<Value, float>) {
    values.push_back(v);
  } else {
    values.insert(values.end(), {v[0], v[1], v[2]});
  }
}

openvdb::Coord corner(const V3i& block) { return {block.x * 8, block.y * 8, block.z * 8}; }

// Asks now and then whether to go on: OpenVDB itself has no way to be stopped.
struct Watch {
  const std::function<bool()>& go_on;
  std::mutex one_at_a_time;
  bool stopped = false;  // once told to, nobody asks again
  void ask() {
    if (!go_on) return;
    const std::lock_guard lock(one_at_a_time);
    stopped = stopped || !go_on();
    if (stopped) throw std::runtime_error("stopped");
  }
};

std::uint32_t compression_of(const VdbWriteJob& job) {
  return (job.codec == VolumeCodec::kZip ? openvdb::io::COMPRESS_ZIP : openvdb::io::COMPRESS_BLOSC) | openvdb::io::COMPRESS_ACTIVE_MASK;
}

// A grid on its way into a file. The leaves of its tree hold no values: those are compressed already, in the tree's order.
// OpenVDB itself fills a tree with 512 values a leaf, however few are active, and compresses one leaf after the other, twice: once for the sizes.
struct PackedGrid {
  openvdb::GridBase::Ptr grid;
  std::uint32_t compression = 0;
  std::vector<std::string> leaves;  // kPart of them a string
};

constexpr std::size_t kPart = 64;   // leaves: about a millisecond's work

template <class Leaf>
void set_mask(const Block& block, Leaf& leaf) {
  for (std::size_t word = 0; word < 8; ++word) leaf.getValueMask().template getWord<std::uint64_t>(static_cast<openvdb::Index>(word)) = block.mask[word];
}

// Topology and tiles.
template <class GridType>
typename GridType::Ptr build(const Layer& layer, const Channel& channel) {
  using Leaf = typename GridType::TreeType::LeafNodeType;
  using Value = typename GridType::ValueType;
  auto grid = GridType::create(openvdb::zeroVal<Value>());
  for (const Block& block : layer.set.blocks) {
    auto leaf = std::make_unique<Leaf>(openvdb::PartialCreate(), corner(block.at), openvdb::zeroVal<Value>(), false);
    set_mask(block, *leaf);
    grid->tree().addLeaf(leaf.release());
  }
  for (std::size_t t = 0; t < layer.tiles.size(); ++t)
    grid->tree().addTile(1, corner(layer.tiles[t]), value_at<Value>(channel.tiles, t), true);
  return grid;
}

// Blocks in the order in which the tree has its leaves.
template <class Tree>
std::vector<std::size_t> tree_order(const Tree& tree, const Layer& layer) {
  using Leaf = typename Tree::LeafNodeType;
  std::unordered_map<const Leaf*, std::size_t> place;
  place.reserve(layer.set.blocks.size());
  for (std::size_t b = 0; b < layer.set.blocks.size(); ++b) place[tree.probeConstLeaf(corner(layer.set.blocks[b].at))] = b;
  std::vector<std::size_t> order;
  order.reserve(place.size());
  for (auto leaf = tree.cbeginLeaf(); leaf; ++leaf) order.push_back(place.at(leaf.getLeaf()));
  return order;
}

template <class GridType>
PackedGrid pack_grid(const Layer& layer, const Channel& channel, bool as_half, std::uint32_t compression, Watch& watch) {
  using Leaf = typename GridType::TreeType::LeafNodeType;
  using Value = typename GridType::ValueType;
  static_assert(Leaf::DIM == 8);
  constexpr std::int64_t kMaskBytes = Leaf::SIZE / 8;  // a leaf's bytes begin with its mask; then one byte says what its inactive values are
  const typename GridType::Ptr grid = build<GridType>(layer, channel);
  grid->setSaveFloatAsHalf(as_half);
  const std::vector<std::size_t> order = tree_order(grid->tree(), layer);

  PackedGrid packed{grid, compression, std::vector<std::string>((order.size() + kPart - 1) / kPart)};
  struct Extent { std::int64_t bytes = 0; std::int8_t code = 0; };
  std::vector<Extent> extents(order.size());
  tbb::parallel_for(std::size_t{0}, packed.leaves.size(), [&](std::size_t part) {
    watch.ask();
    Leaf leaf(openvdb::Coord(), openvdb::zeroVal<Value>(), false);
    std::ostringstream out;
    out.exceptions(std::ios::badbit | std::ios::failbit);
    openvdb::io::setDataCompression(out, compression);
    const std::size_t first = part * kPart, last = std::min(order.size(), first + kPart);
    for (std::size_t i = first; i < last; ++i) {
      const Block& block = layer.set.blocks[order[i]];
      set_mask(block, leaf);
      Value* values = leaf.buffer().data();
      std::fill(values, values + Leaf::SIZE, openvdb::zeroVal<Value>());
      auto from = static_cast<std::size_t>(block.first);
      for (std::size_t word = 0; word < 8; ++word)
        for (std::uint64_t left = block.mask[word]; left; left &= left - 1)
          values[word << 6 | static_cast<std::size_t>(__builtin_ctzll(left))] = value_at<Value>(channel.values, from++);
      const std::int64_t begin = out.tellp();
      leaf.writeBuffers(out, as_half);
      extents[i].bytes = std::int64_t{out.tellp()} - begin;
    }
    packed.leaves[part] = std::move(out).str();
    const char* at = packed.leaves[part].data();
    for (std::size_t i = first; i < last; at += extents[i++].bytes) extents[i].code = static_cast<std::int8_t>(at[kMaskBytes]);
  });

  // What Archive::writeGrid says of a grid as a whole.
  grid->addStatsMetadata();
  const auto loaded = static_cast<openvdb::Int64>(grid->tree().memUsage() + order.size() * Leaf::SIZE * sizeof(Value));
  grid->insertMeta(openvdb::GridBase::META_FILE_MEM_BYTES, openvdb::Int64Metadata(loaded));
  grid->insertMeta(openvdb::GridBase::META_FILE_COMPRESSION, openvdb::StringMetadata(openvdb::io::compressionToString(compression)));
  if (order.empty()) return packed;
  openvdb::io::DelayedLoadMetadata jumps;  // who loads leaves only when they are looked at jumps over the others
  jumps.resizeMask(order.size());
  jumps.resizeCompressedSize(order.size());
  for (std::size_t i = 0; i < order.size(); ++i) {
    jumps.setMask(i, extents[i].code);
    jumps.setCompressedSize(i, extents[i].bytes - kMaskBytes - 1);
  }
  grid->insertMeta(openvdb::GridBase::META_FILE_DELAYED_LOAD, jumps);
  return packed;
}

// x -> h·x + first, as Transform::createLinearTransform(h) and postTranslate(first) have it. Those refuse voxels of less than 3e-15 units³, 14 µm where the
// unit is a metre, for singular; a transform that is read is not asked.
openvdb::math::Transform::Ptr make_transform(double h, const openvdb::Vec3d& first) {
  const openvdb::Vec3d inverse(1 / h);
  std::stringstream stored;
  openvdb::io::setCurrentVersion(stored);
  openvdb::writeString(stored, openvdb::math::UniformScaleTranslateMap::mapType());
  for (const openvdb::Vec3d& part : {first, openvdb::Vec3d(h), openvdb::Vec3d(h), inverse, inverse * inverse, inverse / 2}) part.write(stored);
  auto transform = std::make_shared<openvdb::math::Transform>();
  transform->read(stored);
  return transform;
}

void describe(openvdb::GridBase& grid, const Channel& channel, const VdbWriteJob& job) {
  const Grid& g = job.level->grid;
  grid.setName(channel.name);
  grid.setGridClass(openvdb::GRID_FOG_VOLUME);
  grid.setIsInWorldSpace(true);
  if (channel.components == 3)
    grid.setVectorType(channel.name == "normal" ? openvdb::VEC_COVARIANT_NORMALIZE : openvdb::VEC_INVARIANT);
  // OpenVDB's cell centres are at integer indices: index (0,0,0) is half a voxel above the box's corner.
  const V3d first = g.centre(V3i(0, 0, 0));
  grid.setTransform(make_transform(g.h, openvdb::Vec3d(first.x, first.y, first.z)));
  grid.insertMeta("voxel_edge", openvdb::DoubleMetadata(g.h));
  grid.insertMeta("level", openvdb::Int32Metadata(job.number));
  if (const Meaning* m = meaning_of(channel.name)) {
    grid.insertMeta("meaning", openvdb::StringMetadata(m->text));
    grid.insertMeta("units", openvdb::StringMetadata(m->units));
  }
}

// All of a file that comes before its grids.
std::string file_head(std::uint32_t grids, std::uint32_t compression) {
  openvdb::MetaMap meta;
  meta.insertMeta("creator", openvdb::StringMetadata(kCreator));
  SeekableArchive archive;
  archive.setCompression(compression);
  std::ostringstream out;
  out.exceptions(std::ios::badbit | std::ios::failbit);
  archive.write_grids(out, {}, meta);
  std::string head = std::move(out).str();  // ends with the number of grids
  std::memcpy(head.data() + head.size() - sizeof grids, &grids, sizeof grids);
  return head;
}

// As Archive::writeGrid, which would have the leaves' values in the tree.
void write_grid(std::ostream& out, PackedGrid packed, Watch& watch) {
  const openvdb::GridBase& grid = *packed.grid;
  openvdb::io::GridDescriptor descriptor(grid.getName(), grid.type(), grid.saveFloatAsHalf());
  descriptor.writeHeader(out);
  const std::streampos places = out.tellp();
  descriptor.writeStreamPos(out);
  descriptor.setGridPos(out.tellp());
  openvdb::io::setDataCompression(out, packed.compression);
  out.write(reinterpret_cast<const char*>(&packed.compression), sizeof packed.compression);
  grid.writeMeta(out);
  grid.writeTransform(out);
  grid.writeTopology(out);
  descriptor.setBlockPos(out.tellp());
  for (std::string& leaves : packed.leaves) {
    out.write(leaves.data(), static_cast<std::streamsize>(leaves.size()));
    leaves = {};
    watch.ask();
  }
  descriptor.setEndPos(out.tellp());
  out.seekp(places);
  descriptor.writeStreamPos(out);
  out.seekp(0, std::ios::end);
}

void write_level(const VdbWriteJob& job) {
  Watch watch{.go_on = job.go_on, .one_at_a_time = {}};
  const std::uint32_t compression = compression_of(job);
  std::ofstream out;
  out.exceptions(std::ios::badbit | std::ios::failbit);
  out.open(job.path, std::ios::binary | std::ios::trunc);
  const std::string head = file_head(static_cast<std::uint32_t>(job.half.size()), compression);
  out.write(head.data(), static_cast<std::streamsize>(head.size()));
  std::size_t number = 0;
  for (const Layer& layer : job.level->layers)
    for (const Channel& channel : layer.channels) {
      const bool as_half = job.half.at(number++);
      PackedGrid packed = channel.components == 3 ? pack_grid<openvdb::Vec3SGrid>(layer, channel, as_half, compression, watch) : pack_grid<openvdb::FloatGrid>(layer, channel, as_half, compression, watch);
      describe(*packed.grid, channel, job);
      write_grid(out, std::move(packed), watch);
    }
  out.close();
}

template <class GridType>
void take(const GridType& grid, Channel& channel, Layer& layer) {
  using Value = typename GridType::ValueType;
  using Leaf = typename GridType::TreeType::LeafNodeType;
  const auto block_of = [](const openvdb::Coord& c) { return V3i(c.x() >> 3, c.y() >> 3, c.z() >> 3); };
  const auto order = [](const V3i& a, const V3i& b) { return std::tie(a.z, a.y, a.x) < std::tie(b.z, b.y, b.x); };

  std::vector<const Leaf*> leaves;
  grid.tree().getNodes(leaves);
  std::erase_if(leaves, [](const Leaf* leaf) { return leaf->isEmpty(); });
  std::sort(leaves.begin(), leaves.end(), [&](const Leaf* a, const Leaf* b) { return order(block_of(a->origin()), block_of(b->origin())); });
  for (const Leaf* leaf : leaves) {
    Block block;
    block.at = block_of(leaf->origin());
    block.first = layer.set.count;
    for (std::size_t word = 0; word < 8; ++word) block.mask[word] = leaf->getValueMask().template getWord<std::uint64_t>(static_cast<openvdb::Index>(word));
    layer.set.count += leaf->onVoxelCount();
    layer.set.blocks.push_back(block);
    const Value* values = leaf->buffer().data();
    for (auto on = leaf->getValueMask().beginOn(); on; ++on) append(channel.values, values[on.pos()]);
  }

  std::vector<std::pair<V3i, Value>> tiles;
  auto it = grid.tree().cbeginValueOn();
  it.setMaxDepth(decltype(it)::LEAF_DEPTH - 1);
  for (; it; ++it) {
    openvdb::CoordBBox box;
    it.getBoundingBox(box);
    if (box.dim() != openvdb::Coord(8)) throw openvdb::ValueError("tile of " + std::to_string(box.dim().x()) + "^3 voxels");
    tiles.emplace_back(block_of(box.min()), it.getValue());
  }
  std::sort(tiles.begin(), tiles.end(), [&](const auto& a, const auto& b) { return order(a.first, b.first); });
  for (const auto& [at, value] : tiles) {
    layer.tiles.push_back(at);
    append(channel.tiles, value);
  }
}

VdbGrid convert(const openvdb::GridBase& grid) {
  VdbGrid result;
  Channel channel;
  channel.name = grid.getName();
  channel.full_float = !grid.saveFloatAsHalf();
  if (const auto* scalar = dynamic_cast<const openvdb::FloatGrid*>(&grid)) {
    take(*scalar, channel, result.layer);
  } else if (const auto* vector = dynamic_cast<const openvdb::Vec3SGrid*>(&grid)) {
    channel.components = 3;
    take(*vector, channel, result.layer);
    result.vector_type = openvdb::GridBase::vecTypeToString(grid.getVectorType());
  } else {
    throw openvdb::TypeError("grid " + channel.name + " is of type " + grid.valueType());
  }
  result.layer.channels.push_back(std::move(channel));
  result.grid_class = openvdb::GridBase::gridClassToString(grid.getGridClass());
  const auto& transform = grid.constTransform();
  if (transform.isLinear() && transform.hasUniformScale()) {
    // Not the difference of two places, which has few digits left far from the origin.
    const openvdb::Vec3d low = transform.indexToWorld(openvdb::Vec3d(-0.5)), along = transform.baseMap()->applyJacobian(openvdb::Vec3d(1));
    const openvdb::Vec3d size = transform.voxelSize();
    // A rotated or mirrored map has a uniform scale too; the diagonal tells.
    if (along.eq(size, 1e-9 * size.x())) {
      result.linear = true;
      result.h = size.x();
      result.origin = V3d(low.x(), low.y(), low.z());
    }
  }
  return result;
}

void read_level(const std::string& path, std::vector<VdbGrid>& out) {
  std::vector<std::string> names;
  {
    openvdb::io::File file(path);
    file.open(/*delayLoad=*/false);
    for (auto name = file.beginName(); name != file.endName(); ++name) names.push_back(*name);
  }
  out.resize(names.size());
  tbb::parallel_for(std::size_t{0}, names.size(), [&](std::size_t i) {
    openvdb::io::File file(path);  // one each: a file has one read position
    file.open(/*delayLoad=*/false);
    const openvdb::GridBase::Ptr grid = file.readGrid(names[i]);
    if (!grid) throw openvdb::IoError("grid " + names[i] + " cannot be read");
    out[i] = convert(*grid);
  });
}

template <class GridType>
void take_samples(const GridType& grid, VdbVolume& out) {
  using Leaf = typename GridType::TreeType::LeafNodeType;
  static_assert(Leaf::DIM == 8);
  openvdb::CoordBBox box = grid.evalActiveVoxelBoundingBox();
  if (box.empty()) throw std::runtime_error("grid \"" + grid.getName() + "\" has no active voxel");
  box.expand(1);
  const openvdb::Coord first(box.min().x() & ~7, box.min().y() & ~7, box.min().z() & ~7);
  SampleGrid& to = out.grid;
  to.n = V3i(box.max().x() - first.x() + 1, box.max().y() - first.y() + 1, box.max().z() - first.z() + 1);
  const V3i blocks = to.block_count();
  if (static_cast<double>(blocks.x) * blocks.y * blocks.z > double(1 << 27))
    throw std::runtime_error("grid \"" + grid.getName() + "\" reaches over " + std::to_string(to.n.x) + " x " + std::to_string(to.n.y) + " x " + std::to_string(to.n.z) + " voxels, too many");
  to.outside = static_cast<float>(grid.background());
  if (!std::isfinite(to.outside)) throw std::runtime_error("grid \"" + grid.getName() + "\" has a background that is not a finite number");
  const auto checked = [&](double v) {
    if (std::isfinite(static_cast<float>(v))) return static_cast<float>(v);
    ++out.bad;
    return to.outside;
  };
  const auto accessor = grid.getConstAccessor();
  for (int z = 0; z < blocks.z; ++z)
    for (int y = 0; y < blocks.y; ++y)
      for (int x = 0; x < blocks.x; ++x) {
        const openvdb::Coord at = first + openvdb::Coord(x * 8, y * 8, z * 8);
        const Leaf* leaf = accessor.template probeConstNode<Leaf>(at);
        if (!leaf) {
          to.blocks.push_back(~static_cast<std::int32_t>(to.constants.size()));
          to.constants.push_back(checked(static_cast<double>(accessor.getValue(at))));
          continue;
        }
        const std::size_t base = to.data.size();
        to.blocks.push_back(static_cast<std::int32_t>(base / 512));
        to.data.resize(base + 512);
        const auto* values = leaf->buffer().data();
        for (std::size_t i = 0; i < 512; ++i)  // OpenVDB runs along z first
          to.data[base + ((i >> 6) | (i & 0x38) | (i & 7) << 6)] = checked(static_cast<double>(values[i]));
      }
  const auto& transform = grid.constTransform();
  if (!transform.isLinear()) throw std::runtime_error("grid \"" + grid.getName() + "\" has a map that is not linear");
  const auto world = [&](double i, double j, double k) {
    const openvdb::Vec3d p = transform.indexToWorld(openvdb::Vec3d(first.x() + i, first.y() + j, first.z() + k));
    return V3d(p.x(), p.y(), p.z());
  };
  to.origin = world(0, 0, 0);
  for (int a = 0; a < 3; ++a) to.step[a] = world(a == 0, a == 1, a == 2) - to.origin;
  const double volume = to.step[0].dot(to.step[1].cross(to.step[2]));
  if (!std::isfinite(volume) || volume == 0) throw std::runtime_error("grid \"" + grid.getName() + "\" has a map that squeezes space flat");
}

std::string kind_of(const openvdb::GridBase& grid) {
  const std::string type = grid.type(), value = grid.valueType();
  if (type.find("ptdata") != std::string::npos || value.find("ptdata") != std::string::npos) return "points";
  if (value.find("vec") != std::string::npos) return "vectors";
  return value;
}

std::string take_volume(const std::string& path, VdbVolume& out) {
  openvdb::io::File file(path);
  file.open(/*delayLoad=*/false);
  std::string wanted, refused;
  std::int64_t usable = 0;
  for (auto name = file.beginName(); name != file.endName(); ++name) {
    const openvdb::GridBase::Ptr head = file.readGridMetadata(*name);
    const std::string value = head ? head->valueType() : std::string();
    if (value == "float" || value == "double") {
      ++usable;
      if (wanted.empty() || (*name == "density" && wanted != "density")) wanted = *name;  // a pack's volume has eight more
    } else {
      refused += (refused.empty() ? "" : ", ") + std::string("grid \"") + *name + "\" holds " + (head ? kind_of(*head) : "nothing");
    }
  }
  if (wanted.empty()) {
    out.unsupported = !refused.empty();
    return refused.empty() ? "holds no grid" : refused + ", which cannot be baked";
  }
  const openvdb::GridBase::Ptr grid = file.readGrid(wanted);
  out.name = wanted;
  out.others = usable - 1;
  out.level_set = grid->getGridClass() == openvdb::GRID_LEVEL_SET;
  if (const auto floats = openvdb::gridPtrCast<openvdb::FloatGrid>(grid)) take_samples(*floats, out);
  else if (const auto doubles = openvdb::gridPtrCast<openvdb::DoubleGrid>(grid)) take_samples(*doubles, out);
  else return "grid \"" + wanted + "\" is of a tree that is not read";
  return {};
}

// One line, whatever the library says.
std::string one_line(std::string text) {
  std::replace(text.begin(), text.end(), '\n', ' ');
  return text.empty() ? "unknown error" : text;
}

std::string write(const VdbWriteJob& job, bool* disk_full) {
  try {
    openvdb::initialize();
    errno = 0;
    write_level(job);
    return {};
  } catch (const std::ios_base::failure& e) {
    const int cause = errno;
    *disk_full = cause == ENOSPC || cause == EDQUOT || cause == EFBIG;
    return one_line(cause ? std::strerror(cause) : e.what());
  } catch (const std::exception& e) {
    return one_line(e.what());
  } catch (...) {
    return one_line({});
  }
}

std::string read(const std::string& path, std::vector<VdbGrid>* grids) {
  try {
    openvdb::initialize();
    grids->clear();
    read_level(path, *grids);
    return {};
  } catch (const std::exception& e) {
    return one_line(e.what());
  } catch (...) {
    return one_line({});
  }
}

std::string read_volume(const std::string& path, VdbVolume* volume) {
  try {
    openvdb::initialize();
    *volume = {};
    return take_volume(path, *volume);
  } catch (const std::exception& e) {
    return one_line(e.what());
  } catch (...) {
    return one_line({});
  }
}

}  // namespace

extern "C" __attribute__((visibility("default"))) const VdbFunctions texel_vdb_functions{kVdbModuleVersion, write, read, read_volume};

}  // namespace texel
