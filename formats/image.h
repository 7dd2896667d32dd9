#pragma once
// Pictures in memory and the one place where they are read and written.
#include <cstdint>
#include <string>
#include <vector>

namespace texel {

// width·height·channels floats, row 0 on top, channels interleaved. Colour channels are linear light (decoded from sRGB once,
// on reading), alpha is linear and colour is straight (not premultiplied).
struct Image {
  int width = 0, height = 0;
  int channels = 0;          // 1 grey, 2 grey + alpha, 3 RGB, 4 RGBA
  std::vector<float> pixels;
  [[nodiscard]] bool empty() const { return pixels.empty(); }
  [[nodiscard]] bool has_alpha() const { return channels == 2 || channels == 4; }
  [[nodiscard]] float* at(int x, int y) { return pixels.data() + (static_cast<std::size_t>(y) * static_cast<std::size_t>(width) + static_cast<std::size_t>(x)) * static_cast<std::size_t>(channels); }
  [[nodiscard]] const float* at(int x, int y) const { return const_cast<Image*>(this)->at(x, y); }
};

// sRGB transfer function (IEC 61966-2-1) and its inverse, in [0,1]; values outside are clamped by encode.
[[nodiscard]] float srgb_to_linear(float encoded);
[[nodiscard]] float linear_to_srgb(float linear);

// Reads any picture the image library knows. 8- and 16-bit integer colour is taken as sRGB, float colour as linear;
// `raw` leaves values as stored (for alpha masks and heights). Loads the image module on first use.
// Throws Error{kFile} when the file is missing or damaged, Error{kUnsupported} when the module is not installed. Thread-safe.
[[nodiscard]] Image read_image(const std::string& path, bool raw = false);
// The same of a picture's file in memory: PNG, JPEG or WebP. `name`: what messages call it.
[[nodiscard]] Image read_image(const std::string& bytes, const std::string& name, bool raw);

// Alpha >= cutoff counts as 1, below as 0, of alpha as bilinear interpolation between the texels has it: each texel gets the share of its
// area where it is 1, to 1/16. Does nothing without an alpha channel.
void threshold_alpha(Image& image, float cutoff);

// A picture's values as stored, for heights: no curve is undone and nothing is scaled, so that every integer and every float is exact.
struct Samples {
  int width = 0, height = 0;
  std::vector<double> values;  // row 0 on top; NaN where a pixel has alpha 0. Of colour the luminance 0.2126 R + 0.7152 G + 0.0722 B of the
                               // values as stored, exactly the grey where R = G = B; associated alpha is divided out
  double full = 1;             // the largest value of the file's type: 255, 65535 …; 1 for floating point
};

// Throws as read_image. Memory: 8 bytes a pixel, and while reading the pixels as stored.
[[nodiscard]] Samples read_samples(const std::string& path);

// Pixels of a picture that are not wholly transparent, and those of them brighter than 8 bits can hold: a channel above 1 by more than half
// a step, stored as 1.
struct PixelCount {
  std::int64_t seen = 0, clipped = 0;
};

// 8-bit PNG: straight alpha, sRGB colour. Deterministic bytes. Needs no image module. Channels 1..4. `count`, when not null, receives the
// picture's pixels. Throws Error{kFile}.
void write_png(const Image& image, const std::string& path, PixelCount* count = nullptr);

// Half-float EXR: premultiplied linear. Deterministic bytes. Loads the image module. Throws as read_image.
void write_exr(const Image& image, const std::string& path);

}  // namespace texel
