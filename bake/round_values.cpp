#include "bake/round_values.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "bake/ndf.h"

namespace texel {
namespace {

// The largest power of two that is not above x > 0.
double power_below(double x) {
  int exponent = 0;
  std::frexp(x, &exponent);
  return std::ldexp(1.0, exponent - 1);
}

double nearest(double v, double step) { return std::nearbyint(v / step) * step; }

// Steps. A share's shrinks towards 0 and 1.
double share_step(double v, double error) { return power_below(2 * error * std::min(1.0, 4 * power_below(std::min(v, 1 - v)))); }
double amount_step(double v, double error) { return power_below(2 * error * std::max(1.0, v != 0 ? power_below(std::abs(v)) : 0)); }

double round_share(double v, double error) { return v > 0 && v < 1 ? nearest(v, share_step(v, error)) : v; }
double round_relative(double v, double error) { return v != 0 ? nearest(v, power_below(2 * error * power_below(std::abs(v)))) : v; }

// (v' − v)/(√v' + √v) with v' >= p, the power of two below v: half a step of 4·error·√p is within error, and no step is longer than p.
double round_color(double v, double error) {
  if (!(v > 0)) return v;
  const double p = power_below(v);
  return nearest(v, std::min(p, power_below(4 * error * std::sqrt(p))));
}

double round_amount(double v, double error) {
  if (v == 0) return v;
  const double q = nearest(v, amount_step(v, error));
  return q != 0 ? q : std::copysign(power_below(std::abs(v)), v);  // what is there stays there
}

double round_value(const std::string& grid, double v, double error) {
  switch (norm_of(grid)) {
    case Norm::kShare: return round_share(v, error);
    case Norm::kRelative: return round_relative(v, error);
    case Norm::kColor: return round_color(v, error);
    default: return round_amount(v, error);
  }
}

// Up or down, whichever brings the sum so far nearer to what it was: steps of `error`, so that both are within it.
void round_sum(std::vector<float>& values, bool share, double error, double& left, ValueErrors& errors) {
  for (float& value : values) {
    const double v = static_cast<double>(value);
    double q = v;
    if (v > 0 && (!share || v < 1)) {
      const double step = share ? share_step(v, error / 2) : amount_step(v, error / 2);
      double low = std::floor(v / step) * step;
      const double high = low < v ? low + step : low;
      if (low == 0) low = power_below(v);
      q = std::abs(low - (v + left)) <= std::abs(high - (v + left)) ? low : high;
    }
    value = static_cast<float>(q);
    left += v - static_cast<double>(value);
    errors.add(difference(share ? Norm::kShare : Norm::kAmount, v, static_cast<double>(value)));
  }
}

using Triple = std::array<double, 3>;

// Not longer than it was where that would be longer than 1.
Triple round_normal(const Triple& n, double error) {
  const double step = power_below(error);  // so that both neighbours are within `error`
  Triple q;
  for (std::size_t k = 0; k < 3; ++k) q[k] = nearest(n[k], step);
  while (q[0] * q[0] + q[1] * q[1] + q[2] * q[2] > 1) {
    std::size_t worst = 0;
    const auto over = [&](std::size_t k) { return std::abs(q[k]) - std::abs(n[k]); };
    for (std::size_t k = 1; k < 3; ++k)
      if (over(k) > over(worst)) worst = k;
    if (!(over(worst) > 0)) break;
    q[worst] = std::trunc(n[worst] / step) * step;
  }
  return q;
}

// Rounded to the nearest step an entry is off by half a step, and adding one step to the diagonal nearly always makes up for what that does to the
// eigenvalues. Rounded up, the diagonal is never short: entries off it then change an eigenvalue by one step at most, which one step more makes up for.
// The diagonal is off by two steps at most, hence steps of half an error.
void round_matrix(Triple& diagonal, Triple& off, double error) {
  const double step = power_below(error / 2);
  const Triple given = diagonal;
  for (double& v : off) v = nearest(v, step);
  const auto indefinite = [&] {
    return eigen({.xx = diagonal[0], .yy = diagonal[1], .zz = diagonal[2], .xy = off[0], .xz = off[1], .yz = off[2]}).value[2] < -1e-9;
  };
  for (double& v : diagonal) v = nearest(v, step);
  if (!indefinite()) return;
  for (double& v : diagonal) v += step;
  if (!indefinite()) return;
  for (std::size_t k = 0; k < 3; ++k) diagonal[k] = std::ceil(given[k] / step) * step + step;
}

constexpr std::size_t kChunk = 3 << 14;  // values: whole vectors

// work(first, last, errors) over values, in parallel; errors added in order.
template <class Work>
ValueErrors in_chunks(std::size_t count, Work&& work) {
  std::vector<ValueErrors> parts((count + kChunk - 1) / kChunk);
  tbb::parallel_for(std::size_t{0}, parts.size(), [&](std::size_t i) { work(i * kChunk, std::min(count, (i + 1) * kChunk), parts[i]); });
  ValueErrors all;
  for (const ValueErrors& part : parts) all.add(part);
  return all;
}

template <class Round>
ValueErrors round_triples(std::vector<float>& values, Round&& round) {
  return in_chunks(values.size(), [&](std::size_t first, std::size_t last, ValueErrors& errors) {
    for (std::size_t i = first; i < last; i += 3) {
      const Triple was{static_cast<double>(values[i]), static_cast<double>(values[i + 1]), static_cast<double>(values[i + 2])};
      const Triple is = round(was);
      for (std::size_t k = 0; k < 3; ++k) {
        values[i + k] = static_cast<float>(is[k]);
        errors.add(difference(Norm::kEntry, was[k], is[k]));
      }
    }
  });
}

void round_matrices(const std::string& name, std::vector<float>& diagonals, std::vector<float>& offs, double error, std::vector<GridErrors>& to) {
  std::vector<float> rounded = offs;
  const ValueErrors in_diagonal = in_chunks(diagonals.size(), [&](std::size_t first, std::size_t last, ValueErrors& errors) {
    for (std::size_t i = first; i < last; i += 3) {
      Triple d, o;
      for (std::size_t k = 0; k < 3; ++k) { d[k] = static_cast<double>(diagonals[i + k]); o[k] = static_cast<double>(offs[i + k]); }
      const Triple was = d;
      if (d != Triple{} || o != Triple{}) round_matrix(d, o, error);
      for (std::size_t k = 0; k < 3; ++k) {
        diagonals[i + k] = static_cast<float>(d[k]);
        rounded[i + k] = static_cast<float>(o[k]);
        errors.add(difference(Norm::kEntry, was[k], d[k]));
      }
    }
  });
  const ValueErrors off_it = in_chunks(offs.size(), [&](std::size_t first, std::size_t last, ValueErrors& errors) {
    for (std::size_t i = first; i < last; ++i) errors.add(difference(Norm::kEntry, static_cast<double>(offs[i]), static_cast<double>(rounded[i])));
  });
  offs = std::move(rounded);
  add_errors(name + "_diag", in_diagonal, to);
  add_errors(name + "_off", off_it, to);
}

void round_layer(Layer& layer, double error, std::vector<GridErrors>& to) {
  constexpr const char* kMatrices[] = {"S", "S1", "S2"};
  std::array<Channel*, 3> diagonals{}, offs{};
  for (Channel& c : layer.channels) {
    bool of_matrix = false;
    for (std::size_t m = 0; m < 3; ++m)
      for (auto [part, channel] : {std::pair{"_diag", &diagonals[m]}, std::pair{"_off", &offs[m]}})
        if (c.name == std::string(kMatrices[m]) + part) {
          *channel = &c;
          of_matrix = true;
        }
    if (of_matrix) continue;
    if (c.name == "area" || c.name == "solid") {
      ValueErrors errors;
      double left = 0;
      round_sum(c.values, c.name == "solid", error, left, errors);
      left = 0;  // a tile is 512 voxels: none makes up for another
      round_sum(c.tiles, c.name == "solid", error, left, errors);
      add_errors(c.name, errors, to);
      continue;
    }
    for (std::vector<float>* values : {&c.values, &c.tiles}) {
      if (c.name == "normal") {
        add_errors(c.name, round_triples(*values, [&](const Triple& n) { return round_normal(n, error); }), to);
        continue;
      }
      const Norm norm = norm_of(c.name);
      add_errors(c.name, in_chunks(values->size(), [&](std::size_t first, std::size_t last, ValueErrors& errors) {
                   for (std::size_t i = first; i < last; ++i) {
                     const double was = static_cast<double>((*values)[i]);
                     (*values)[i] = static_cast<float>(round_value(c.name, was, error));
                     errors.add(difference(norm, was, static_cast<double>((*values)[i])));
                   }
                 }), to);
    }
  }
  for (std::size_t m = 0; m < 3; ++m) {
    if (!diagonals[m] || !offs[m]) continue;
    round_matrices(kMatrices[m], diagonals[m]->values, offs[m]->values, error, to);
    round_matrices(kMatrices[m], diagonals[m]->tiles, offs[m]->tiles, error, to);
  }
}

}  // namespace

std::vector<GridErrors> round_levels(std::vector<Level>& levels, double error) {
  std::vector<GridErrors> errors;
  for (Level& level : levels)
    for (Layer& layer : level.layers) round_layer(layer, error, errors);
  return errors;
}

}  // namespace texel
