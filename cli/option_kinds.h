#pragma once
// Kinds of values: each completes an option row's head with set, get and what is accepted.
#include <algorithm>
#include <array>
#include <string>
#include <utility>
#include <vector>

#include "cli/options.h"

namespace texel {

inline constexpr int kMostVoxels = 4096;

[[nodiscard]] std::string range_text(double low, double high);
// All of `value` as a whole number in low…high; false where it is none.
[[nodiscard]] bool read_integer(const std::string& value, int low, int high, int* out);

template <class Ref>
OptionRow toggle(OptionRow row, Ref ref) {
  row.accepts = "true, false";
  row.set = [ref](Settings& s, const std::string& text) {
    if (text != "true" && text != "false") return false;
    ref(s) = text == "true";
    return true;
  };
  row.get = [ref](const Settings& s) { return std::string(ref(s) ? "true" : "false"); };
  return row;
}

template <class Ref>
OptionRow text(OptionRow row, Ref ref) {
  row.set = [ref](Settings& s, const std::string& value) {
    if (value.empty()) return false;
    ref(s) = value;
    return true;
  };
  row.get = [ref](const Settings& s) { return ref(s); };
  return row;
}

// `word` stands for the value `meaning` ("all" for −1); null: no such word.
template <class Ref>
OptionRow integer(OptionRow row, Ref ref, int low, int high, const char* word = nullptr, int meaning = 0) {
  row.accepts = (word ? std::string(word) + ", " : "") + range_text(low, high);
  row.set = [=](Settings& s, const std::string& value) {
    if (word && value == word) {
      ref(s) = meaning;
      return true;
    }
    return read_integer(value, low, high, &ref(s));
  };
  row.get = [=](const Settings& s) { return word && ref(s) == meaning ? std::string(word) : std::to_string(ref(s)); };
  return row;
}

struct NumberRange {
  double low, high;
  bool open_low = false;   // low itself is out
  bool zero_is_none = false;  // 0 means "not given": get() is empty
};

template <class Ref>
OptionRow number(OptionRow row, Ref ref, NumberRange interval) {
  const bool unlimited = !(interval.high < 1e300);
  const std::string low = number_text(interval.low);
  row.accepts = unlimited ? (interval.open_low ? "> " : ">= ") + low
                          : interval.open_low ? "> " + low + ", <= " + number_text(interval.high) : range_text(interval.low, interval.high);
  row.set = [=](Settings& s, const std::string& value) {
    double v = 0;
    if (!read_number(value, &v)) return false;
    if (v < interval.low || v > interval.high || (interval.open_low && v == interval.low)) return false;
    ref(s) = v;
    return true;
  };
  row.get = [=](const Settings& s) {
    const double v = ref(s);
    return (interval.zero_is_none && v == 0) || v < interval.low ? std::string() : number_text(v);  // below all that can be given: not given
  };
  return row;
}

// A number that need not be given.
template <class Ref>
OptionRow maybe_number(OptionRow row, Ref ref) {
  row.accepts = "a number";
  row.set = [=](Settings& s, const std::string& value) {
    double v = 0;
    if (!read_number(value, &v)) return false;
    ref(s) = v;
    return true;
  };
  row.get = [=](const Settings& s) { return ref(s) ? number_text(*ref(s)) : std::string(); };
  return row;
}

template <class Ref, class Enum>
OptionRow choice(OptionRow row, Ref ref, std::vector<std::pair<const char*, Enum>> values) {
  for (const auto& [word, value] : values) row.accepts += (row.accepts.empty() ? "" : ", ") + std::string(word);
  row.set = [=](Settings& s, const std::string& given) {
    for (const auto& [word, value] : values)
      if (given == word) {
        ref(s) = value;
        return true;
      }
    return false;
  };
  row.get = [=](const Settings& s) {
    for (const auto& [word, value] : values)
      if (ref(s) == value) return std::string(word);
    return std::string();
  };
  return row;
}

template <class Ref>
OptionRow axes(OptionRow row, Ref ref) {
  row.accepts = "x, y, z, any of them";
  row.list = true;
  row.set = [ref](Settings& s, const std::string& value) {
    std::array<bool, 3> on{};
    for (const std::string& axis : split(value, ',')) {
      if (axis.size() != 1 || axis[0] < 'x' || axis[0] > 'z') return false;
      on[static_cast<std::size_t>(axis[0] - 'x')] = true;
    }
    ref(s) = on;
    return true;
  };
  row.get = [ref](const Settings& s) {
    std::string value;
    for (std::size_t i = 0; i < 3; ++i)
      if (ref(s)[i]) value += (value.empty() ? "" : ",") + std::string(1, static_cast<char>('x' + i));
    return value;
  };
  return row;
}

template <class Number, class Read, class Text, class Ref>
OptionRow list_of(OptionRow row, const std::string& each, Read read, Text text, Ref ref) {
  row.accepts = each + ", one or several, with commas";
  row.set = [=](Settings& s, const std::string& value) {
    std::vector<Number> all;
    for (const std::string& part : split(value, ',')) {
      Number number = 0;
      if (!read(part, &number)) return false;
      all.push_back(number);
    }
    std::sort(all.begin(), all.end());
    all.erase(std::unique(all.begin(), all.end()), all.end());
    ref(s) = all;
    return true;
  };
  row.get = [=](const Settings& s) {
    std::string value;
    for (const Number number : ref(s)) value += (value.empty() ? "" : ",") + text(number);
    return value;
  };
  return row;
}
template <class Ref>
OptionRow integers(OptionRow row, int low, int high, Ref ref) {
  return list_of<int>(std::move(row), range_text(low, high), [=](const std::string& part, int* n) { return read_integer(part, low, high, n); }, [](int n) { return std::to_string(n); }, ref);
}
template <class Ref>
OptionRow numbers(OptionRow row, NumberRange range, Ref ref) {
  const std::string each = range.open_low ? "> " + number_text(range.low) + ", <= " + number_text(range.high) : range_text(range.low, range.high);
  const auto read = [=](const std::string& part, double* v) { return read_number(part, v) && *v <= range.high && (range.open_low ? *v > range.low : *v >= range.low); };
  return list_of<double>(std::move(row), each, read, number_text, ref);
}

// Options with a form of their own.
[[nodiscard]] OptionRow resolution(OptionRow row);
[[nodiscard]] OptionRow box(OptionRow row);
[[nodiscard]] OptionRow extent(OptionRow row);
[[nodiscard]] OptionRow height_color(OptionRow row);
[[nodiscard]] OptionRow perlin_field(OptionRow row);
[[nodiscard]] OptionRow want(OptionRow row);
[[nodiscard]] OptionRow light(OptionRow row);
[[nodiscard]] OptionRow memory(OptionRow row);
[[nodiscard]] OptionRow picture_size(OptionRow row);
[[nodiscard]] OptionRow allow(OptionRow row);
[[nodiscard]] OptionRow background(OptionRow row);

}  // namespace texel
