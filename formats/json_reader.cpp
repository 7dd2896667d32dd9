#include "formats/json_reader.h"

#include <algorithm>
#include <cmath>

#include "formats/error.h"

namespace texel {
namespace {

constexpr int kMostDepth = 500;  // the library writes values by recursion, and messages show them

}  // namespace

Json parse_json(const Input& input, std::size_t most_bytes, const std::string& kind, const std::string& example) {
  if (input.bytes.size() > most_bytes)
    throw Error(Code::kUnsupported, input.path, "is too large for a " + kind + " (" + std::to_string(input.bytes.size()) + " bytes)", "the most is " + std::to_string(most_bytes >> 20) + " MiB");
  const auto line = [&](std::size_t byte) {
    const auto end = input.bytes.begin() + static_cast<std::ptrdiff_t>(std::min(byte, input.bytes.size()));
    return input.path + ":" + std::to_string(1 + std::count(input.bytes.begin(), end, '\n'));
  };
  int depth = 0;
  const auto shallow = [&](int at, Json::parse_event_t, Json&) { depth = std::max(depth, at); return at <= kMostDepth; };
  try {
    Json json = Json::parse(input.bytes.begin(), input.bytes.end(), shallow);
    if (depth > kMostDepth) throw Error(Code::kBadInput, input.path, "is nested more than " + std::to_string(kMostDepth) + " deep", "make it flatter");
    return json;
  } catch (const Json::parse_error& error) {
    throw Error(Code::kBadInput, line(error.byte), "is not JSON", "a " + kind + " is " + example);
  } catch (const Json::out_of_range&) {
    throw Error(Code::kBadInput, input.path, "holds a number too large to compute with", "the largest is about 1e100");
  }
}

void JsonReader::fail(const std::string& path, const std::string& what, const std::string& hint) const {
  throw Error(Code::kBadInput, file_, (path.empty() ? "" : path + " ") + what, hint);
}

std::string JsonReader::shown(const Json& v) {
  std::string text = v.dump(-1, ' ', false, Json::error_handler_t::replace);
  if (text.size() > 60) text = text.substr(0, 57) + "...";
  return text;
}

std::string JsonReader::member(const std::string& path, const std::string& key) {
  const bool plain = !key.empty() && std::all_of(key.begin(), key.end(), [](unsigned char c) { return c > 32 && c < 127 && c != '/' && c != '"' && c != '\\'; });
  return path + "/" + (plain ? key : shown(Json(key)));
}

void JsonReader::check_keys(const Json& object, const std::string& path, std::span<const char* const> known) const {
  if (!object.is_object()) fail(path.empty() ? "/" : path, "is " + shown(object), "expected an object");
  for (const auto& [key, value] : object.items()) {
    if (std::any_of(known.begin(), known.end(), [&, &k = key](const char* name) { return k == name; })) continue;
    std::string names;
    for (const char* name : known) names += (names.empty() ? "" : ", ") + std::string(name);
    fail(path + "/" + Json(key).dump(-1, ' ', false, Json::error_handler_t::replace), "is an unknown key", "known: " + names);
  }
}

double JsonReader::number(const Json& v, const std::string& path) const {
  if (!v.is_number() || !(std::abs(v.get<double>()) < 1e100)) fail(path, "is " + shown(v), "expected a number");
  return v.get<double>();
}

double JsonReader::positive(const Json& v, const std::string& path) const {
  const double d = number(v, path);
  if (!(d > 0)) fail(path, "is " + shown(v), "expected a number > 0");
  return d;
}

std::vector<double> JsonReader::numbers(const Json& v, const std::string& path, std::size_t count) const {
  if (!v.is_array() || v.size() != count) fail(path, "is " + shown(v), "expected " + std::to_string(count) + " numbers");
  std::vector<double> r;
  for (std::size_t i = 0; i < count; ++i) r.push_back(number(v[i], path + "/" + std::to_string(i)));
  return r;
}

V3d JsonReader::vector(const Json& v, const std::string& path) const {
  const std::vector<double> n = numbers(v, path, 3);
  return {n[0], n[1], n[2]};
}

V3d JsonReader::direction(const Json& v, const std::string& path) const {
  const V3d d = vector(v, path);
  if (!(d.length() > 1e-100)) fail(path, "is " + shown(v), "expected a direction other than 0");
  return d.normalized();
}

std::string JsonReader::text(const Json& v, const std::string& path) const {
  if (!v.is_string()) fail(path, "is " + shown(v), "expected text");
  std::string t = v.get<std::string>();
  if (t.empty() || t.find('\0') != std::string::npos) fail(path, "is " + shown(v), "expected a name");
  return t;
}

const Json& JsonReader::need(const Json& object, const char* key, const std::string& path) const {
  if (!object.contains(key)) fail(path, std::string("has no \"") + key + "\"", "see " + manual_);
  return object.at(key);
}

V3d JsonReader::vector_or(const Json& object, const char* key, const std::string& path, const V3d& otherwise) const {
  return object.contains(key) ? vector(object.at(key), path + "/" + key) : otherwise;
}

float JsonReader::share(const Json& v, const std::string& path, double most) const {
  const double d = number(v, path);
  if (!(d >= 0 && d <= most)) fail(path, "is " + shown(v), "expected a number from 0 to " + std::to_string(static_cast<int>(most)));
  return static_cast<float>(d);
}

V3f JsonReader::color(const Json& v, const std::string& path, double most) const {
  (void)numbers(v, path, 3);
  V3f c;
  for (int i = 0; i < 3; ++i) c[i] = share(v[static_cast<std::size_t>(i)], path + "/" + std::to_string(i), most);
  return c;
}

}  // namespace texel
