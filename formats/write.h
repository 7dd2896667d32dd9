#pragma once
// Pack -> folder.
#include <future>
#include <string>

#include "formats/pack.h"

namespace texel {

enum class SliceFormat { kPng, kExr };
enum class VolumeCodec { kBlosc, kZip };   // OpenVDB's own two: Blosc (LZ4) is the quicker, zip the smaller

struct WriteOptions {
  bool full_float = false;                 // grids as 32-bit floats rather than halves
  VolumeCodec codec = VolumeCodec::kBlosc;
  SliceFormat slice_format = SliceFormat::kPng;
  int threads = 0;                         // 0: all
};

// Writes the pack beside `folder` and swaps it in by one rename (two names exchanged where a pack is already there), so that a
// kill at any moment leaves the old pack or the new one. The manifest is written last. Bytes depend on the pack alone.
// Source hashes missing from pack.sources are computed here. Leftovers of killed writes to the same folder are removed.
// Throws Error{kFile} when the place cannot be written or is a folder that is not a pack, Error{kRunning} when the disk is full.
void write_pack(const Pack& pack, const std::string& folder, const WriteOptions& options, Report& report);

// Throws Error{kFile} where write_pack would find that `folder` cannot take a pack, before the work and not after it. Makes nothing.
void require_place(const std::string& folder);

// Opens the volume module in a thread of its own, so that write_pack need not wait for it (0.05 s). The result joins when it goes.
// Throws Error{kUnsupported} at once where the module is not installed: before the work, not after it.
[[nodiscard]] std::future<void> open_volume_writer();
// Throws Error{kUnsupported} where slices of this format cannot be written for want of the image module.
void require_slice_writer(SliceFormat format);

// Hex SHA-256 of a file's bytes. Throws Error{kFile}.
[[nodiscard]] std::string file_sha256(const std::string& path, std::int64_t* bytes = nullptr);

// Whether `folder` holds a pack made by this version from sources with the same bytes and the same recipe, and is whole
// (all files there with the sizes the manifest states). Never throws: any doubt is "no". `why` says what differs.
[[nodiscard]] bool pack_up_to_date(const std::string& folder, const Scene& scene, const std::string& recipe_json, std::string* why = nullptr);

}  // namespace texel
