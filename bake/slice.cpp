#include "bake/slice.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace texel {
namespace {

std::span<const Crossing> ray_of(const Band& band, std::size_t id) {
  return {band.crossings.data() + band.first[id], band.crossings.data() + band.first[id + 1]};
}

int slice_of(const Bundle& bundle, const Crossing& c, int count) {
  if (count == bundle.nw) return c.cell;
  const double x = std::clamp(c.w * count / bundle.nw, -2.0, count + 2.0), wall = std::floor(x);
  return static_cast<int>(wall) - ((c.enters < 0) == (c.winding != 0) && x == wall ? 1 : 0);
}

// One ray's share of one slice: seen from the low and from the high side, the mean of both, as a stack is.
void add_crossings(const Bundle& bundle, std::span<const Crossing> list, int winding, double u, double v, const SliceShader& shade, SliceScratch::Sum& sum) {
  const auto& scene = *bundle.scene;
  const auto opacity = [&](const Crossing& c) {
    return static_cast<double>(c.coverage) * static_cast<double>(scene.materials[crossed_material(bundle, c)].opacity);
  };
  int above = winding;
  for (const Crossing& c : list) above += c.winding;
  double open = 1;
  bool stopped = winding != 0;
  for (int inside = winding; const Crossing& c : list) {
    inside += c.winding;
    stopped = stopped || inside != 0;
    open *= 1 - opacity(c);
  }
  sum.alpha += stopped ? 1 : 1 - open;

  double front = winding != 0 ? 0 : 1, back = above != 0 ? 0 : 1;
  if (list.size() == 1) {  // the usual case: one look-up
    const double weight = opacity(list[0]) * (front + back) / 2;
    if (weight > 0) {
      sum.color += V3d(shade.crossing(bundle, list[0], u, v)) * weight;
      sum.weight += weight;
    }
    return;
  }
  std::vector<double> weights(list.size(), 0.0);
  int inside = winding;
  for (std::size_t i = 0; i < list.size() && front > 0; ++i) {
    weights[i] += front * opacity(list[i]) / 2;
    inside += list[i].winding;
    front = inside != 0 ? 0 : front * (1 - opacity(list[i]));
  }
  inside = above;
  for (std::size_t i = list.size(); i-- > 0 && back > 0;) {
    weights[i] += back * opacity(list[i]) / 2;
    inside -= list[i].winding;
    back = inside != 0 ? 0 : back * (1 - opacity(list[i]));
  }
  for (std::size_t i = 0; i < list.size(); ++i) {
    if (!(weights[i] > 0)) continue;
    sum.color += V3d(shade.crossing(bundle, list[i], u, v)) * weights[i];
    sum.weight += weights[i];
  }
}

}  // namespace

int first_slice_of(int voxel, int count, int voxels) {
  if (count == voxels) return voxel;
  const auto middle = [&](int k) { return static_cast<int>((k + 0.5) * voxels / count); };
  int k = static_cast<int>(std::int64_t{voxel} * count / voxels);
  while (k < count && middle(k) < voxel) ++k;
  while (k > 0 && middle(k - 1) >= voxel) --k;
  return k;
}

void slice_column(const Bundle& bundle, const Band& band, const SliceColumn& place, const SliceShader& shade, SliceScratch& scratch, SliceBand& out) {
  const RayPattern& pattern = bundle.pattern;
  const int column = place.column, row = place.row, count = place.count;
  if (scratch.sums.size() < static_cast<std::size_t>(count)) {
    scratch.sums.resize(static_cast<std::size_t>(count));
    scratch.is_touched.resize(static_cast<std::size_t>(count), false);
    scratch.voxel.resize(static_cast<std::size_t>(count), -1);
  }
  const auto for_each_ray = [&](auto&& call) {
    for (int r = 0; r < pattern.rows; ++r)
      for (int j = 0; j < pattern.per_row; ++j) {
        const std::size_t row_in_band = static_cast<std::size_t>(row - band.v0) * static_cast<std::size_t>(pattern.rows) + static_cast<std::size_t>(r);
        const std::size_t id = (row_in_band * static_cast<std::size_t>(band.width) + static_cast<std::size_t>(band.place(column))) * static_cast<std::size_t>(pattern.per_row);
        const auto list = ray_of(band, id + static_cast<std::size_t>(j));
        if (list.empty()) continue;
        const double u = column + pattern.u[static_cast<std::size_t>(r * pattern.per_row + j)] * 0x1p-16, v = row + pattern.v[static_cast<std::size_t>(r)] * 0x1p-16;
        call(list, u, v);
      }
  };
  const auto touch = [&](int k) {
    if (k < place.first || k >= place.last || scratch.is_touched[static_cast<std::size_t>(k)]) return;
    scratch.is_touched[static_cast<std::size_t>(k)] = true;
    scratch.touched.push_back(k);
  };
  bool any = false;
  scratch.touched.clear();
  for_each_ray([&](std::span<const Crossing> list, double, double) {
    any = true;
    for (const Crossing& c : list) touch(slice_of(bundle, c, count));
  });
  if (!any && (place.cells.empty() || count != bundle.nw)) return;
  for (const Cell& cell : place.cells) {
    const int end = first_slice_of(cell.k + 1, count, bundle.nw);
    for (int k = first_slice_of(cell.k, count, bundle.nw); k < end; ++k) {
      touch(k);
      scratch.voxel[static_cast<std::size_t>(k)] = cell.index;
    }
  }
  std::sort(scratch.touched.begin(), scratch.touched.end());

  scratch.inside_above.assign(scratch.touched.size(), 0);
  int inside_first = 0;
  for_each_ray([&](std::span<const Crossing> list, double u, double v) {
    int winding = 0;
    std::size_t c = 0;
    const int start = scratch.touched.empty() ? place.last : scratch.touched.front();
    for (; c < list.size() && slice_of(bundle, list[c], count) < start; ++c) winding += list[c].winding;
    inside_first += winding != 0;
    for (std::size_t i = 0; i < scratch.touched.size(); ++i) {
      const int k = scratch.touched[i];
      SliceScratch::Sum& sum = scratch.sums[static_cast<std::size_t>(k)];
      const std::size_t from = c;
      const int before = winding;
      for (; c < list.size() && slice_of(bundle, list[c], count) == k; ++c) winding += list[c].winding;
      if (c > from) add_crossings(bundle, list.subspan(from, c - from), before, u, v, shade, sum);
      else sum.alpha += before != 0;
      scratch.inside_above[i] += winding != 0;
    }
  });

  const int rays = pattern.rays();
  const auto at = static_cast<std::uint32_t>(row) * static_cast<std::uint32_t>(bundle.nu) + static_cast<std::uint32_t>(column);
  int from = place.first, inside = inside_first;
  for (std::size_t i = 0; i <= scratch.touched.size(); ++i) {
    const int to = i < scratch.touched.size() ? scratch.touched[i] : place.last;
    if (inside > 0 && to > from) out.runs.push_back({at, from, to, static_cast<float>(inside) / static_cast<float>(rays)});
    if (i == scratch.touched.size()) break;
    from = to + 1;
    inside = scratch.inside_above[i];
    SliceScratch::Sum& sum = scratch.sums[static_cast<std::size_t>(to)];
    double alpha = sum.alpha / rays;
    if (const std::int64_t voxel = scratch.voxel[static_cast<std::size_t>(to)]; voxel >= 0 && count == bundle.nw)
      alpha = alpha > 0 ? std::min(1.0, alpha * static_cast<double>(place.gain[static_cast<std::size_t>(voxel)])) : static_cast<double>(place.missed[static_cast<std::size_t>(voxel)]);
    if (alpha > 0) {
      SliceRecords::Pixel p{at, -1, -1, -1, static_cast<float>(alpha)};
      V3f color(-1, -1, -1);
      if (sum.weight > 0) {
        color = V3f(sum.color / sum.weight);
      } else if (scratch.voxel[static_cast<std::size_t>(to)] >= 0) {
        V3i voxel;
        voxel[bundle.axes.u] = column;
        voxel[bundle.axes.v] = row;
        voxel[bundle.axes.w] = count == bundle.nw ? to : static_cast<int>((to + 0.5) * bundle.nw / count);
        color = shade.voxel(voxel, scratch.voxel[static_cast<std::size_t>(to)]);
      }
      p.r = color.x;
      p.g = color.y;
      p.b = color.z;
      out.records.push_back({to, p});
    }
    sum = {};
    scratch.is_touched[static_cast<std::size_t>(to)] = false;
    scratch.voxel[static_cast<std::size_t>(to)] = -1;
  }
}

SliceRecords gather_slices(int axis, int width, int height, int count, std::vector<SliceBand>& bands) {
  SliceRecords all;
  all.axis = axis;
  all.count = count;
  all.width = width;
  all.height = height;
  all.first.assign(static_cast<std::size_t>(count) + 1, 0);
  for (const SliceBand& band : bands)
    for (const auto& r : band.records) ++all.first[static_cast<std::size_t>(r.slice) + 1];
  for (std::size_t k = 0; k < static_cast<std::size_t>(count); ++k) all.first[k + 1] += all.first[k];
  all.pixels.resize(all.first.back());
  std::vector<std::size_t> at(all.first.begin(), all.first.end() - 1);
  for (SliceBand& band : bands) {
    for (const auto& r : band.records) all.pixels[at[static_cast<std::size_t>(r.slice)]++] = r.pixel;
    all.runs.insert(all.runs.end(), band.runs.begin(), band.runs.end());
    band = {};
  }
  const std::size_t words = (all.runs.size() + 63) / 64;
  all.reaching.assign(words * static_cast<std::size_t>(count / SliceRecords::kRunGroup + 1), 0);
  for (std::size_t i = 0; i < all.runs.size(); ++i)
    for (int g = all.runs[i].first / SliceRecords::kRunGroup; g <= (all.runs[i].last - 1) / SliceRecords::kRunGroup; ++g)
      all.reaching[static_cast<std::size_t>(g) * words + i / 64] |= std::uint64_t{1} << (i % 64);
  return all;
}

namespace {

constexpr float kOutside = -2, kNoColor = -1;  // in the red of pixels still without colour

// Nearest coloured pixel for every pixel that lacks one (exact Euclidean feature transform: Meijster, Roerdink & Hesselink 2000).
// Works on the rows and columns [x0, x1) × [y0, y1) only. Outside pixels farther than kBleed keep kOutside.
void spread_color(Image& image, int x0, int x1, int y0, int y1) {
  const int w = x1 - x0, h = y1 - y0;
  constexpr int kNone = 1 << 20;
  std::vector<int> nearest(static_cast<std::size_t>(w) * static_cast<std::size_t>(h));  // signed distance to the nearest coloured pixel of the column
  const auto cell = [&](int x, int y) -> int& { return nearest[static_cast<std::size_t>(y) * static_cast<std::size_t>(w) + static_cast<std::size_t>(x)]; };
  const auto colored = [&](int x, int y) { return image.at(x0 + x, y0 + y)[0] >= 0; };
  for (int x = 0; x < w; ++x) cell(x, 0) = colored(x, 0) ? 0 : kNone;
  for (int y = 1; y < h; ++y)
    for (int x = 0; x < w; ++x) cell(x, y) = colored(x, y) ? 0 : cell(x, y - 1) == kNone ? kNone : cell(x, y - 1) - 1;
  for (int y = h - 2; y >= 0; --y)
    for (int x = 0; x < w; ++x) {
      const int below = cell(x, y + 1) == kNone ? kNone : cell(x, y + 1) + 1;
      if (std::abs(below) < std::abs(cell(x, y))) cell(x, y) = below;
    }
  std::vector<int> stack(static_cast<std::size_t>(w)), start(static_cast<std::size_t>(w));
  std::vector<int> source(static_cast<std::size_t>(w));
  // In place: only pixels without colour are written, and only those with one from the start are read.
  for (int y = 0; y < h; ++y) {
    bool needed = false;
    for (int x = 0; x < w && !needed; ++x) needed = !colored(x, y);
    if (!needed) continue;
    const auto g2 = [&](int i) { const std::int64_t g = cell(i, y); return g * g; };
    const auto distance = [&](int x, int i) { return std::int64_t{x - i} * (x - i) + g2(i); };
    int top = -1;
    for (int u = 0; u < w; ++u) {
      if (cell(u, y) == kNone) continue;
      int from = 0;
      while (top >= 0) {
        const int i = stack[static_cast<std::size_t>(top)];
        if (distance(start[static_cast<std::size_t>(top)], i) > distance(start[static_cast<std::size_t>(top)], u)) { --top; continue; }
        const std::int64_t num = std::int64_t{u} * u - std::int64_t{i} * i + g2(u) - g2(i);
        from = static_cast<int>(std::min<std::int64_t>(w, (num >= 0 ? num / (2 * (u - i)) : -1) + 1));
        break;
      }
      if (from < w) {
        ++top;
        stack[static_cast<std::size_t>(top)] = u;
        start[static_cast<std::size_t>(top)] = top == 0 ? 0 : from;
      }
    }
    if (top < 0) continue;
    for (int x = w - 1, q = top; x >= 0; --x) {
      while (q > 0 && start[static_cast<std::size_t>(q)] > x) --q;
      source[static_cast<std::size_t>(x)] = stack[static_cast<std::size_t>(q)];
    }
    for (int x = 0; x < w; ++x) {
      float* p = image.at(x0 + x, y0 + y);
      if (p[0] >= 0) continue;
      const int sx = source[static_cast<std::size_t>(x)];
      if (p[0] == kOutside && distance(x, sx) > kBleed * kBleed) continue;
      const float* s = image.at(x0 + sx, y0 + y + cell(sx, y));
      std::copy(s, s + 3, p);
    }
  }
}

std::span<const SliceRecords::Pixel> pixels_of(const SliceRecords& records, int k) {
  return {records.pixels.data() + records.first[static_cast<std::size_t>(k)], records.pixels.data() + records.first[static_cast<std::size_t>(k) + 1]};
}

// Mean colour of a slice's pixels that have one, by their opacity; weight 0: none has.
struct SliceMean {
  V3d color{0, 0, 0};
  double weight = 0;
  bool uniform = true;                          // they all have this one
};

SliceMean mean_of(std::span<const SliceRecords::Pixel> pixels) {
  SliceMean mean;
  const SliceRecords::Pixel* first = nullptr;
  for (const SliceRecords::Pixel& p : pixels) {
    if (p.r < 0) continue;
    if (!first) first = &p;
    mean.uniform = mean.uniform && p.r == first->r && p.g == first->g && p.b == first->b;
    const double a = static_cast<double>(p.a);
    mean.color += V3d(static_cast<double>(p.r), static_cast<double>(p.g), static_cast<double>(p.b)) * a;
    mean.weight += a;
  }
  // A slice of one colour has it everywhere, exactly: nothing to spread.
  if (mean.weight > 0) mean.color = mean.uniform ? V3d(static_cast<double>(first->r), static_cast<double>(first->g), static_cast<double>(first->b)) : mean.color / mean.weight;
  return mean;
}

// The nearest pixel of a picture that repeats is at most half a period away: the same on a picture with half a period more on each side.
void spread_over_borders(Image& image, bool wrap_x, bool wrap_y) {
  const int left = wrap_x ? (image.width + 1) / 2 : 0, top = wrap_y ? (image.height + 1) / 2 : 0;
  Image wide;
  wide.width = image.width + 2 * left;
  wide.height = image.height + 2 * top;
  wide.channels = 4;
  wide.pixels.resize(static_cast<std::size_t>(wide.width) * static_cast<std::size_t>(wide.height) * 4);
  for (int y = 0; y < wide.height; ++y)
    for (int x = 0; x < wide.width; ++x) {
      const float* p = image.at((x - left + image.width) % image.width, (y - top + image.height) % image.height);
      std::copy(p, p + 4, wide.at(x, y));
    }
  spread_color(wide, 0, wide.width, 0, wide.height);
  for (int y = 0; y < image.height; ++y) std::copy(wide.at(left, top + y), wide.at(left, top + y) + std::ptrdiff_t{4} * image.width, image.at(0, y));
}

}  // namespace

Image slice_image(const SliceRecords& records, const std::array<bool, 3>& cyclic, int k) {
  const std::span<const SliceRecords::Pixel> pixels = pixels_of(records, k);
  SliceMean mean = mean_of(pixels);
  const bool spread = mean.weight > 0 && !mean.uniform;
  // Wholly inside, as ground that repeats is below its surface: the colour of the nearest slice that has one.
  bool inside = false;
  if (mean.weight <= 0) records.for_runs(k, [&](const auto&) { inside = true; });
  for (int step = 1; inside && mean.weight <= 0 && step < records.count; ++step)
    for (const int near : {k + step, k - step})
      if (mean.weight <= 0 && near >= 0 && near < records.count) mean = mean_of(pixels_of(records, near));

  Image image;
  image.width = records.width;
  image.height = records.height;
  image.channels = 4;
  const float background[4] = {static_cast<float>(mean.color.x), static_cast<float>(mean.color.y), static_cast<float>(mean.color.z), 0};
  std::vector<float> row(static_cast<std::size_t>(image.width) * 4);
  for (std::size_t i = 0; i < row.size(); ++i) row[i] = background[i % 4];
  image.pixels.reserve(row.size() * static_cast<std::size_t>(image.height));
  for (int y = 0; y < image.height; ++y) image.pixels.insert(image.pixels.end(), row.begin(), row.end());

  int x0 = image.width, x1 = 0, y0 = image.height, y1 = 0;
  // Records come row by row: only a new row needs a division.
  const auto width = static_cast<std::uint32_t>(records.width);
  std::uint32_t row_start = 0;
  int row_y = records.height - 1;
  const auto pixel = [&](std::uint32_t at) {
    if (at - row_start >= width) {
      const std::uint32_t above = at / width;
      row_start = above * width;
      row_y = records.height - 1 - static_cast<int>(above);
    }
    return std::pair(static_cast<int>(at - row_start), row_y);
  };
  const BundleAxes axes = bundle_axes(records.axis);
  const bool wrap_x = cyclic[static_cast<std::size_t>(axes.u)], wrap_y = cyclic[static_cast<std::size_t>(axes.v)];
  const auto reach = [&](std::uint32_t at) {
    const auto [x, y] = pixel(at);
    x0 = std::min(x0, x - kBleed);
    x1 = std::max(x1, x + 1 + kBleed);
    y0 = std::min(y0, y - kBleed);
    y1 = std::max(y1, y + 1 + kBleed);
  };
  for (const SliceRecords::Pixel& p : pixels) reach(p.at);
  records.for_runs(k, [&](const SliceRecords::Run& run) { reach(run.at); });
  x0 = std::max(0, x0);
  y0 = std::max(0, y0);
  x1 = std::min(image.width, x1);
  y1 = std::min(image.height, y1);
  if (wrap_x || wrap_y) {  // whatever may be reached across a border
    x0 = y0 = 0;
    x1 = image.width;
    y1 = image.height;
  }
  if (spread)
    for (int y = y0; y < y1; ++y)
      for (int x = x0; x < x1; ++x) image.at(x, y)[0] = kOutside;

  for (const SliceRecords::Pixel& source : pixels) {
    const auto [x, y] = pixel(source.at);
    float* p = image.at(x, y);
    p[3] = source.a;
    if (!spread) continue;
    p[0] = source.r >= 0 ? source.r : kNoColor;
    p[1] = source.g;
    p[2] = source.b;
  }
  records.for_runs(k, [&](const SliceRecords::Run& run) {
    const auto [x, y] = pixel(run.at);
    float* p = image.at(x, y);
    p[3] = run.alpha;
    if (spread) p[0] = kNoColor;
  });
  if (!spread) return image;
  if (wrap_x || wrap_y) spread_over_borders(image, wrap_x, wrap_y);
  else spread_color(image, x0, x1, y0, y1);
  for (int y = y0; y < y1; ++y)
    for (int x = x0; x < x1; ++x)
      if (float* p = image.at(x, y); p[0] < 0) std::copy(background, background + 3, p);
  return image;
}

namespace {

// Two slices, lower first, into one of half the size (method: docs/slices.md): depth composed, plane averaged, all premultiplied.
Image coarser_slice(const Image& low, const Image& high) {
  Image out;
  out.width = (low.width + 1) / 2;
  out.height = (low.height + 1) / 2;
  out.channels = 4;
  out.pixels.resize(static_cast<std::size_t>(out.width) * static_cast<std::size_t>(out.height) * 4);
  for (int y = 0; y < out.height; ++y)
    for (int x = 0; x < out.width; ++x) {
      double sum[4] = {0, 0, 0, 0}, plain[3] = {0, 0, 0};
      for (int q = 0; q < 4; ++q) {
        // Rows count from the top; an odd row or column short of a partner is paired with nothing, as the volume's levels are.
        const int sx = 2 * x + (q & 1), sy = low.height - 1 - (2 * (out.height - 1 - y) + (q >> 1));
        const bool there = sx < low.width && sy >= 0;
        const float* a = low.at(std::min(sx, low.width - 1), std::max(sy, 0));
        const float* b = high.empty() ? a : high.at(std::min(sx, low.width - 1), std::max(sy, 0));
        const double aa = static_cast<double>(a[3]), ba = high.empty() ? 0 : static_cast<double>(b[3]);
        for (int c = 0; c < 3; ++c) {
          const double ca = static_cast<double>(a[c]), cb = static_cast<double>(b[c]);
          plain[c] += (ca + cb) / 8;
          if (there) sum[c] += (ca * aa * (1 - ba / 2) + cb * ba * (1 - aa / 2)) / 4;  // mean of the two orders of `over`
        }
        if (there) sum[3] += (1 - (1 - aa) * (1 - ba)) / 4;
      }
      float* p = out.at(x, y);
      for (int c = 0; c < 3; ++c) p[c] = static_cast<float>(sum[3] > 0 ? sum[c] / sum[3] : plain[c]);
      p[3] = static_cast<float>(sum[3]);
    }
  return out;
}

Image level_image(const SliceRecords& records, const std::array<bool, 3>& cyclic, int level, int k) {
  if (level == 0) return k < records.count ? slice_image(records, cyclic, k) : Image{};
  const Image low = level_image(records, cyclic, level - 1, 2 * k);
  return coarser_slice(low, level_image(records, cyclic, level - 1, 2 * k + 1));
}

}  // namespace

SliceStack make_stack(std::shared_ptr<const SliceRecords> records, const Grid& grid, const std::array<bool, 3>& cyclic, int level) {
  SliceStack stack;
  const int add = (1 << level) - 1;
  stack.axis = records->axis;
  stack.level = level;
  stack.count = (records->count + add) >> level;
  stack.width = (records->width + add) >> level;
  stack.height = (records->height + add) >> level;
  stack.thickness = grid.h * grid.n[records->axis] / records->count * static_cast<double>(1 << level);
  stack.image = [records, cyclic, level](int k) { return level_image(*records, cyclic, level, k); };
  return stack;
}

int slices_for_angle(double length, double depth, double angle_degrees) {
  const double n = std::ceil(length * std::tan(angle_degrees * M_PI / 180) / depth - 1e-9);
  return static_cast<int>(std::clamp(n, 1.0, 4096.0));
}

double angle_for_slices(double thickness, double depth) { return std::atan2(depth, thickness) * 180 / M_PI; }

}  // namespace texel
