// texel_image.so: everything that needs OpenImageIO. It links nothing else of ours.
#include "formats/image_module.h"

#include <OpenImageIO/filesystem.h>
#include <OpenImageIO/imageio.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <exception>
#include <limits>
#include <string_view>
#include <vector>

namespace texel {
namespace {

// 4 GiB of floats: no texture is larger, and a damaged header must not ask for more.
constexpr std::int64_t kMostValues = std::int64_t{1} << 30;

int integer_bits_of(const OIIO::TypeDesc& type) {
  if (type.basetype == OIIO::TypeDesc::UINT8) return 8;
  if (type.basetype == OIIO::TypeDesc::UINT16) return 16;
  return 0;
}

// OpenImageIO leaves alpha as the file has it once asked to; formats with associated alpha (EXR) have colour multiplied by it.
void make_straight(Image& image) {
  const auto channels = static_cast<std::size_t>(image.channels);
  for (std::size_t i = 0; i < image.pixels.size(); i += channels) {
    const float alpha = image.pixels[i + channels - 1];
    if (!(alpha > 0)) continue;  // nothing to divide by: the colour stays as stored
    for (std::size_t c = 0; c + 1 < channels; ++c) image.pixels[i + c] /= alpha;
  }
}

bool usable(const OIIO::ImageSpec& spec, std::string& message) {
  const std::int64_t values = std::int64_t{spec.width} * spec.height * spec.nchannels;
  if (spec.width >= 1 && spec.height >= 1 && spec.nchannels >= 1 && spec.width <= 1 << 20 && spec.height <= 1 << 20 && spec.nchannels <= 1024 &&
      values <= kMostValues && spec.depth <= 1 && !spec.deep)
    return true;
  message = "is not a flat picture of a usable size (" + std::to_string(spec.width) + " x " + std::to_string(spec.height) + ", " +
            std::to_string(spec.nchannels) + " channels)";
  return false;
}

// Two channels are grey and alpha only if the file says so; further channels (depth, normals) are no colour.
int channels_of(const OIIO::ImageSpec& spec) {
  int channels = std::min(spec.nchannels, 4);
  if (channels == 2 && spec.alpha_channel != 1) channels = 1;
  if (channels == 4 && spec.alpha_channel != 3) channels = 3;
  return channels;
}

bool read_open(OIIO::ImageInput& file, Image& image, int& integer_bits, std::string& message) {
  const OIIO::ImageSpec& spec = file.spec();
  if (!usable(spec, message)) return false;
  const int channels = channels_of(spec);
  image.width = spec.width;
  image.height = spec.height;
  image.channels = channels;
  image.pixels.resize(static_cast<std::size_t>(spec.width) * static_cast<std::size_t>(spec.height) * static_cast<std::size_t>(channels));
  integer_bits = integer_bits_of(spec.format);
  const bool associated = image.has_alpha() && spec.get_int_attribute("oiio:UnassociatedAlpha", 0) == 0;
  if (!file.read_image(0, 0, 0, channels, OIIO::TypeDesc::FLOAT, image.pixels.data())) {
    message = "is damaged (" + file.geterror() + ")";
    return false;
  }
  if (associated) make_straight(image);
  return true;
}

bool read_file(const char* path, Image& image, int& integer_bits, std::string& message) {
  try {
    OIIO::ImageSpec ask;
    ask.attribute("oiio:UnassociatedAlpha", 1);
    const auto file = OIIO::ImageInput::open(path, &ask);
    if (file) return read_open(*file, image, integer_bits, message);
    message = "is no picture that can be read (" + OIIO::geterror() + ")";
  } catch (const std::exception& e) {
    message = std::string("cannot be read (") + e.what() + ")";
  }
  return false;
}

// The name of a file with these first bytes; null: none that is read from memory.
const char* name_of(const void* bytes, std::size_t count) {
  const std::string_view head(static_cast<const char*>(bytes), std::min<std::size_t>(count, 16));
  if (head.starts_with("\x89PNG")) return "picture.png";
  if (head.starts_with("\xff\xd8\xff")) return "picture.jpg";
  if (head.starts_with("RIFF") && head.substr(8 < head.size() ? 8 : head.size()).starts_with("WEBP")) return "picture.webp";
  return nullptr;
}

bool read_memory(const void* bytes, std::size_t count, Image& image, int& integer_bits, std::string& message) {
  try {
    const char* name = name_of(bytes, count);
    if (!name) {
      message = "is neither PNG, JPEG nor WebP by its first bytes";
      return false;
    }
    OIIO::Filesystem::IOMemReader memory(const_cast<void*>(bytes), count);  // only read; the type has no other constructor
    OIIO::ImageSpec ask;
    ask.attribute("oiio:UnassociatedAlpha", 1);
    void* proxy = static_cast<OIIO::Filesystem::IOProxy*>(&memory);
    ask.attribute("oiio:ioproxy", OIIO::TypeDesc::PTR, &proxy);  // version 2.4 forgets the argument where there is a configuration
    const auto file = OIIO::ImageInput::open(name, &ask, &memory);
    if (file) return read_open(*file, image, integer_bits, message);
    message = "is no picture that can be read (" + OIIO::geterror() + ")";
  } catch (const std::exception& e) {
    message = std::string("cannot be read (") + e.what() + ")";
  }
  return false;
}

template <class T>
bool read_as(OIIO::ImageInput& file, Samples& samples, OIIO::TypeDesc type, std::string& message) {
  const OIIO::ImageSpec& spec = file.spec();
  const int channels = channels_of(spec);
  const bool has_alpha = channels == 2 || channels == 4;
  const bool associated = has_alpha && spec.get_int_attribute("oiio:UnassociatedAlpha", 0) == 0;
  samples.width = spec.width;
  samples.height = spec.height;
  const std::size_t count = static_cast<std::size_t>(spec.width) * static_cast<std::size_t>(spec.height), n = static_cast<std::size_t>(channels);
  if constexpr (std::numeric_limits<T>::is_integer) samples.full = static_cast<double>(std::numeric_limits<T>::max());
  std::vector<T> stored(count * n);
  if (!file.read_image(0, 0, 0, channels, type, stored.data())) {
    message = "is damaged (" + file.geterror() + ")";
    return false;
  }
  samples.values.resize(count);
  for (std::size_t i = 0; i < count; ++i) {
    const T* pixel = stored.data() + i * n;
    double value = static_cast<double>(pixel[0]);
    if (n >= 3 && !(pixel[0] == pixel[1] && pixel[1] == pixel[2]))
      value = 0.2126 * value + 0.7152 * static_cast<double>(pixel[1]) + 0.0722 * static_cast<double>(pixel[2]);
    if (has_alpha) {
      const double alpha = static_cast<double>(pixel[n - 1]) / samples.full;
      if (!(alpha > 0)) value = std::numeric_limits<double>::quiet_NaN();
      else if (associated) value /= alpha;
    }
    samples.values[i] = value;
  }
  return true;
}

bool read_stored(OIIO::ImageInput& file, Samples& samples, std::string& message) {
  if (!usable(file.spec(), message)) return false;
  using OIIO::TypeDesc;
  switch (file.spec().format.basetype) {
    case TypeDesc::UINT8: return read_as<std::uint8_t>(file, samples, TypeDesc::UINT8, message);
    case TypeDesc::INT8: return read_as<std::int8_t>(file, samples, TypeDesc::INT8, message);
    case TypeDesc::UINT16: return read_as<std::uint16_t>(file, samples, TypeDesc::UINT16, message);
    case TypeDesc::INT16: return read_as<std::int16_t>(file, samples, TypeDesc::INT16, message);
    case TypeDesc::UINT32: return read_as<std::uint32_t>(file, samples, TypeDesc::UINT32, message);
    case TypeDesc::INT32: return read_as<std::int32_t>(file, samples, TypeDesc::INT32, message);
    case TypeDesc::HALF:
    case TypeDesc::FLOAT: return read_as<float>(file, samples, TypeDesc::FLOAT, message);
    // OpenImageIO 2.4 reads tiled TIFF files of doubles wrongly, and some others, without a word.
    case TypeDesc::DOUBLE: message = "has 64-bit floats, which are not read reliably"; return false;
    default: message = std::string("has pixels of a type that is no height (") + file.spec().format.c_str() + ")"; return false;
  }
}

bool read_sample_file(const char* path, Samples& samples, std::string& message) {
  try {
    OIIO::ImageSpec ask;
    ask.attribute("oiio:UnassociatedAlpha", 1);
    const auto file = OIIO::ImageInput::open(path, &ask);
    if (file) return read_stored(*file, samples, message);
    message = "is no picture that can be read (" + OIIO::geterror() + ")";
  } catch (const std::exception& e) {
    message = std::string("cannot be read (") + e.what() + ")";
  }
  return false;
}

bool write_exr_file(const char* path, const Image& image, std::string& message) {
  try {
    const auto file = OIIO::ImageOutput::create("exr");
    if (!file) {
      message = "cannot be written (" + OIIO::geterror() + ")";
      return false;
    }
    OIIO::ImageSpec spec(image.width, image.height, image.channels, OIIO::TypeDesc::HALF);
    static constexpr const char* kChannels[4][4] = {{"Y"}, {"Y", "A"}, {"R", "G", "B"}, {"R", "G", "B", "A"}};
    spec.channelnames.clear();
    for (int c = 0; c < image.channels; ++c) spec.channelnames.emplace_back(kChannels[image.channels - 1][c]);
    spec.alpha_channel = image.has_alpha() ? image.channels - 1 : -1;
    spec.attribute("compression", "zip");
    spec.attribute("oiio:ColorSpace", "Linear");
    // A fixed date, so that the same picture gives the same bytes.
    spec.attribute("DateTime", "2000:01:01 00:00:00");
    spec.attribute("Software", "texel");
    if (file->open(path, spec) && file->write_image(OIIO::TypeDesc::FLOAT, image.pixels.data()) && file->close()) return true;
    message = "cannot be written (" + file->geterror() + ")";
  } catch (const std::exception& e) {
    message = std::string("cannot be written (") + e.what() + ")";
  }
  return false;
}

}  // namespace
}  // namespace texel

extern "C" __attribute__((visibility("default"))) const texel::ImageModule texel_image_module;
const texel::ImageModule texel_image_module = {texel::kImageModuleVersion, texel::read_file, texel::read_memory, texel::read_sample_file, texel::write_exr_file};
