#include "bake/facets.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "bake/ndf.h"

namespace texel {

namespace {

// SGGX density of normals, both sides together.
double sggx_density(const Form& s, const V3d& n) {
  const double det = s.determinant();
  if (!(det > 0)) return 0;
  const double form = s.adjugate().form(n, n) / det;
  return form > 0 ? 1 / (std::numbers::pi * std::sqrt(det) * form * form) : 0;
}

constexpr int kNormals = 16;

// Lobes with how much of what is seen from one direction each is (sum 1).
struct SeenLobes {
  int count = 1;
  std::array<Form, 2> s;
  std::array<double, 2> weight{1, 0};
};
SeenLobes seen_lobes(const Facets& facets, const V3d& v) {
  constexpr double kRound = 0.9995;  // sheets have no inverse
  if (!(facets.share_2 > 0)) return {1, {facets.s.rounded(kRound), {}}, {1, 0}};
  SeenLobes seen{2, {facets.lobes[0].rounded(kRound), facets.lobes[1].rounded(kRound)}, {}};
  const std::array<double, 2> share{1 - facets.share_2, facets.share_2};
  for (std::size_t g = 0; g < 2; ++g) {
    const Form& s = seen.s[g];
    seen.weight[g] = share[g] * std::sqrt(std::max(s.form(v, v), 0.0)) / mean_shadow({s.xx, s.yy, s.zz, s.xy, s.xz, s.yz});
  }
  const double sum = seen.weight[0] + seen.weight[1];
  for (double& w : seen.weight) w /= sum;
  return seen;
}

// Fixed normals seen from `v`, each standing for the same share of what is seen: field notes 1.5 (Heitz et al. 2015).
std::array<V3d, kNormals> visible_normals(const Form& s, const V3d& v) {
  const V3d helper = std::abs(v.z) < 0.9 ? V3d(0, 0, 1) : V3d(1, 0, 0);
  const V3d t = helper.cross(v).normalized(), b = v.cross(t);
  const double kk = s.form(t, t), jj = s.form(b, b), ii = std::max(s.form(v, v), 1e-12);
  const double kj = s.form(t, b), ki = s.form(t, v), ji = s.form(b, v);
  const double q = std::sqrt(std::max(jj * ii - ji * ji, 1e-24));
  const double det = std::max(kk * (jj * ii - ji * ji) - kj * (kj * ii - ji * ki) + ki * (kj * ji - jj * ki), 0.0), root = std::sqrt(ii);
  const V3d mk(std::sqrt(det) / q, 0, 0), mj(-(ki * ji - kj * ii) / (root * q), q / root, 0), mi(ki / root, ji / root, root);
  std::array<V3d, kNormals> normals;
  for (int i = 0; i < kNormals; ++i) {
    const double radius = std::sqrt((i + 0.5) / kNormals), angle = 2 * std::numbers::pi * i * 0.6180339887498949;
    const double x = radius * std::cos(angle), y = radius * std::sin(angle), z = std::sqrt(std::max(0.0, 1 - radius * radius));
    const V3d local = mk * x + mj * y + mi * z;
    const V3d n = t * local.x + b * local.y + v * local.z;
    const double length = n.length();
    normals[static_cast<std::size_t>(i)] = length > 0 ? n / length : v;
  }
  return normals;
}

// The mean projected area over all directions, but for a factor; and S's largest eigenvalue.
double mean_area(const Form& s, double* largest) {
  constexpr double p = 1.6075;
  const Eigen3 e = eigen({s.xx, s.yy, s.zz, s.xy, s.xz, s.yz});
  double sum = 0;
  for (const double v : e.value) sum += std::pow(std::max(v, 0.0), p / 2);
  *largest = e.value[0];
  return std::pow(sum / 3, 1 / p);
}

}  // namespace

V3f light_sent(const Facets& facets, const V3d& v, std::span<const Light> lights, const V3f& ambient, const V3d& place,
               const std::function<float(const V3d& l, const Light& light)>& open) {
  const Look& look = facets.look;
  const V3d& m = facets.mean;
  const bool closed = facets.closed;
  const double sidedness = std::min(m.length(), 1.0);
  const SeenLobes seen = seen_lobes(facets, v);
  const auto count = static_cast<std::size_t>(seen.count);

  // Of what is turned to the eye, the part against the mean normal is backs: dark where the surface is open, hidden where it closes
  // a solid. There the nearest normal that is just in sight stands in for what little of the voxel shows.
  std::array<std::array<V3d, kNormals>, 2> normals;
  std::array<std::array<double, kNormals>, 2> weight;
  double total = 0;
  for (std::size_t g = 0; g < count; ++g) {
    normals[g] = visible_normals(seen.s[g], v);
    for (std::size_t i = 0; i < kNormals; ++i) {
      weight[g][i] = seen.weight[g] * (normals[g][i].dot(m) < 0 ? 1 - sidedness : 1.0);
      total += weight[g][i];
    }
  }
  constexpr double kRim = 0.02 * kNormals;
  V3d rim = sidedness > 0 ? m / m.length() : v;
  rim = (rim + v * std::max(0.1 - rim.dot(v), 0.0)).normalized();
  const double norm = closed ? total + kRim : kNormals;

  V3f sum = look.albedo * ambient + look.ke;
  for (const Light& light : lights) {
    V3d l;
    V3f color;
    if (!light_at(light, place, &l, &color)) continue;
    double cosine = closed ? kRim * std::max(rim.dot(l), 0.0) : 0.0;
    for (std::size_t g = 0; g < count; ++g)
      for (std::size_t i = 0; i < kNormals; ++i) cosine += weight[g][i] * std::max(normals[g][i].dot(l), 0.0);
    cosine /= norm;
    if (!(cosine > 1e-6)) continue;
    color *= open(l, light);
    V3f answer = look.albedo * static_cast<float>(cosine);
    if (look.ks.x > 0 || look.ks.y > 0 || look.ks.z > 0) {
      // The lobe spread over the voxel's normals: SGGX of the lobe folded into S, as a mirror flake medium (field notes 1.5).
      const double a = std::clamp(static_cast<double>(look.roughness), static_cast<double>(kMinRoughness), 1.0);
      const V3d h = (v + l).length() > 1e-9 ? (v + l).normalized() : v;
      const double side = closed ? 1.0 : h.dot(m) < 0 ? 1 - sidedness : 1.0;
      const double grazing = std::min(cosine / 0.1, 1.0);
      for (std::size_t g = 0; g < count; ++g) {
        const Form lobe = seen.s[g].rounded(1 - a * a);
        const double across = std::sqrt(std::max(lobe.form(v, v), 1e-4));
        answer += look.ks * static_cast<float>(seen.weight[g] * (std::numbers::pi * sggx_density(lobe, h) / (4 * across) * side * grazing));
      }
    }
    sum += answer * color;
  }
  return sum;
}

Facets carried(const Facets& facets, const std::array<V3d, 3>& back) {
  const auto turned = [&](const V3d& v) { return back[0] * v.x + back[1] * v.y + back[2] * v.z; };  // back^T v
  // back^T S back: first S's columns, then rows.
  const Form& s = facets.s;
  const V3d x = turned(V3d(s.xx, s.xy, s.xz)), y = turned(V3d(s.xy, s.yy, s.yz)), z = turned(V3d(s.xz, s.yz, s.zz));
  const V3d i = turned(V3d(x.x, y.x, z.x)), j = turned(V3d(x.y, y.y, z.y)), k = turned(V3d(x.z, y.z, z.z));
  Facets there = facets;
  there.s = {i.x, j.y, k.z, (i.y + j.x) / 2, (i.z + k.x) / 2, (j.z + k.y) / 2};
  there.share_2 = 0;
  double before = 0, largest = 0;
  const double mean_before = mean_area(s, &before), mean_after = mean_area(there.s, &largest);
  if (!(largest > 0) || !std::isfinite(largest) || !(mean_after > 0)) return facets;
  const double scale = 1 / largest;
  there.s = {there.s.xx * scale, there.s.yy * scale, there.s.zz * scale, there.s.xy * scale, there.s.xz * scale, there.s.yz * scale};
  const V3d mean = turned(facets.mean) * (mean_before / mean_after);
  const double length = mean.length();
  there.mean = length > 1 ? mean / length : mean;  // the formula's error may lead past 1
  return there;
}

}  // namespace texel
