#include "formats/read_placements.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <string_view>
#include <vector>

#include "formats/error.h"

namespace texel {
namespace {

constexpr std::array kTerms = {"x", "y", "z", "scale", "rx", "ry", "rz"};
constexpr std::array kEntries = {"m00", "m01", "m02", "m03", "m10", "m11", "m12", "m13", "m20", "m21", "m22", "m23"};
constexpr std::size_t kMostFields = 12;

bool separates(char c) { return c == ',' || c == ';' || is_blank(c); }

// The fields of a line; false: more than kMostFields. A comma or semicolon may have blanks around it; two of them hold an empty field between.
bool split_fields(std::string_view line, std::array<std::string_view, kMostFields>& fields, std::size_t& count) {
  count = 0;
  std::size_t at = 0;
  const auto blanks = [&] { while (at < line.size() && is_blank(line[at])) ++at; };
  blanks();
  while (at < line.size()) {
    if (count == kMostFields) return false;
    const std::size_t start = at;
    while (at < line.size() && !separates(line[at])) ++at;
    fields[count++] = line.substr(start, at - start);
    blanks();
    if (at < line.size() && (line[at] == ',' || line[at] == ';')) {
      ++at;
      blanks();
      if (at == line.size()) {  // the separator at the end begins an empty field
        if (count == kMostFields) return false;
        fields[count++] = {};
      }
    }
  }
  return true;
}

bool whole(std::string_view text, double& value) {
  return !text.empty() && parse_number(text.data(), text.data() + text.size(), value) == text.data() + text.size();
}

std::string_view unquoted(std::string_view text) {
  return text.size() > 1 && text.front() == '"' && text.back() == '"' ? text.substr(1, text.size() - 2) : text;
}

class Table {
 public:
  Table(const Input& input, Report& report, const std::function<void(const Affine&)>& place) : text_(input), size_(input.bytes.size()), report_(report), place_(place) {}

  void read() {
    const char* const begin = text_.position();
    bool first = true;
    std::uint64_t rows = 0;
    for (; !text_.at_end(); text_.next_line()) {
      const char* start = text_.position();
      const char* stop = start;
      while (stop != text_.end() && !is_line_end(*stop)) ++stop;
      std::string_view line(start, static_cast<std::size_t>(stop - start));
      if (start == begin && line.starts_with("\xEF\xBB\xBF")) line.remove_prefix(3);
      line = line.substr(0, line.find('#'));
      std::array<std::string_view, kMostFields> fields;
      std::size_t count = 0;
      const bool fits = split_fields(line, fields, count);
      if (fits && count == 0) continue;
      if (first && fits && is_head(fields, count)) {
        take_head(fields, count, start);
        first = false;
        continue;
      }
      if (first) take_count(fits ? count : kMostFields + 1, start);
      first = false;
      if (!fits || count != columns_.size())
        fail(start, "has " + (fits ? std::to_string(count) : "more than " + std::to_string(kMostFields)) + " fields", "the rows before have " + std::to_string(columns_.size()));
      row(fields, start);
      if (++rows % 65536 == 0 && report_.progress) report_.progress("place", static_cast<double>(start - begin) / static_cast<double>(size_));
    }
  }

 private:
  [[noreturn]] void fail(const char* at, const std::string& what, const std::string& hint) const { throw Error(Code::kBadInput, text_.where(at), what, hint); }

  // Words rather than numbers: `nan` is a number, and refused as one.
  static bool is_head(const std::array<std::string_view, kMostFields>& fields, std::size_t count) {
    double value = 0;
    return std::none_of(fields.begin(), fields.begin() + static_cast<std::ptrdiff_t>(count), [&](std::string_view field) { return field.empty() || whole(field, value); });
  }

  void take_head(const std::array<std::string_view, kMostFields>& fields, std::size_t count, const char* at) {
    const auto number_of = [](const auto& names, std::string_view name) { return static_cast<std::size_t>(std::find(names.begin(), names.end(), name) - names.begin()); };
    matrix_ = number_of(kEntries, unquoted(fields[0])) < kEntries.size();
    for (std::size_t i = 0; i < count; ++i) {
      const std::string_view name = unquoted(fields[i]);
      const std::size_t column = matrix_ ? number_of(kEntries, name) : number_of(kTerms, name);
      if (column >= (matrix_ ? kEntries.size() : kTerms.size())) fail(at, "has a column " + shown_as(name), matrix_ ? "known: m00, m01 ... m23" : "known: x, y, z, scale, rx, ry, rz, or m00, m01 ... m23");
      if (std::find(columns_.begin(), columns_.end(), column) != columns_.end()) fail(at, "has two columns " + shown_as(name), "leave one out");
      columns_.push_back(column);
    }
    for (std::size_t column = 0; column < (matrix_ ? kEntries.size() : 3); ++column)
      if (std::find(columns_.begin(), columns_.end(), column) == columns_.end())
        fail(at, std::string("has no column ") + (matrix_ ? kEntries[column] : kTerms[column]), matrix_ ? "a matrix has twelve" : "a place has x, y and z");
  }

  void take_count(std::size_t count, const char* at) {
    if (count != 3 && count != 4 && count != 7 && count != 12)
      fail(at, "has " + (count > kMostFields ? "more than " + std::to_string(kMostFields) : std::to_string(count)) + " fields", "expected x y z, x y z scale, x y z scale rx ry rz, or twelve of a matrix");
    matrix_ = count == 12;
    for (std::size_t i = 0; i < count; ++i) columns_.push_back(i);
  }

  void row(const std::array<std::string_view, kMostFields>& fields, const char* at) {
    std::array<double, 12> v{0, 0, 0, 1, 0, 0, 0};
    for (std::size_t i = 0; i < columns_.size(); ++i)
      if (double& value = v[columns_[i]]; !whole(fields[i], value) || !(std::abs(value) <= 1e30)) fail(at, "is no number up to 1e30 (" + shown_as(fields[i]) + ")", "export the table again");
    Affine place;
    if (matrix_) place.m = v;
    else place = Affine::translation({v[0], v[1], v[2]}) * Affine::rotation({0, 0, 1}, v[6]) * Affine::rotation({0, 1, 0}, v[5]) * Affine::rotation({1, 0, 0}, v[4]) * Affine::scale(v[3]);
    if (!place.invertible()) fail(at, "is a transform that makes things flat or infinite", "leave the row out");
    place_(place);
  }

  TextScanner text_;
  std::size_t size_;
  Report& report_;
  const std::function<void(const Affine&)>& place_;
  std::vector<std::size_t> columns_;  // what each field is
  bool matrix_ = false;
};

}  // namespace

void read_placements(const Input& input, Report& report, const std::function<void(const Affine&)>& place) { Table(input, report, place).read(); }

std::uint64_t most_placements(const Input& input) {
  // A file may end its lines with LF, CRLF or CR; of the two counts the larger is that of the lines.
  const auto count = [&](char c) { return static_cast<std::uint64_t>(std::count(input.bytes.begin(), input.bytes.end(), c)); };
  // The shortest row is `0 0 0` and a line end.
  return std::min<std::uint64_t>(std::max(count('\n'), count('\r')), input.bytes.size() / 6) + 1;
}

}  // namespace texel
