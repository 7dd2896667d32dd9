#pragma once
// What the text readers share: a file's bytes without a copy, and lines and numbers out of them.
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <string_view>

namespace texel {

// The bytes of one input and its name in messages. A reader never touches the file itself: tests and fuzzers hand in bytes.
struct Input {
  std::span<const char> bytes;
  std::string path;  // as given; .mtl files and textures are looked for in its folder
};

// A file's bytes, mapped read-only; copied where it can't be mapped (a pipe). Throws Error{kFile}.
class FileBytes {
 public:
  explicit FileBytes(const std::string& path);
  ~FileBytes();
  FileBytes(const FileBytes&) = delete;
  FileBytes& operator=(const FileBytes&) = delete;
  [[nodiscard]] std::span<const char> bytes() const { return bytes_; }

 private:
  std::span<const char> bytes_;
  std::unique_ptr<char[]> copy_;  // empty when mapped
};

[[nodiscard]] inline bool is_blank(char c) { return c == ' ' || c == '\t' || c == '\v' || c == '\f'; }
[[nodiscard]] inline bool is_line_end(char c) { return c == '\n' || c == '\r'; }
[[nodiscard]] inline bool is_digit(char c) { return static_cast<unsigned char>(c - '0') < 10; }

// Reads a decimal number that starts at `at`, correctly rounded whatever the locale; "nan", "inf" and a leading '+' are numbers too,
// and what overflows is infinite. Returns the position behind it, or null when there is no number.
[[nodiscard]] const char* parse_number(const char* at, const char* end, double& value);

// Walks through text line by line, token by token. A line ends with LF, CRLF or CR; a backslash before the line end continues
// the line and counts as a blank. Never reads past the end. Line numbers are counted only when asked for.
class TextScanner {
 public:
  explicit TextScanner(const Input& input)
      : begin_(input.bytes.data()), at_(begin_), end_(begin_ + input.bytes.size()), path_(input.path) {}

  [[nodiscard]] bool at_end() const { return at_ == end_; }
  [[nodiscard]] const char* position() const { return at_; }
  void move_to(const char* position) { at_ = position; }
  [[nodiscard]] const char* end() const { return end_; }
  [[nodiscard]] std::size_t left() const { return static_cast<std::size_t>(end_ - at_); }
  [[nodiscard]] char peek() const { return at_ == end_ ? '\n' : *at_; }

  void skip_blanks() {
    while (at_ != end_) {
      if (is_blank(*at_)) ++at_;
      else if (*at_ != '\\' || !skip_continuation()) return;
    }
  }
  // True when nothing but blanks is left on this line.
  [[nodiscard]] bool line_is_over() {
    skip_blanks();
    return at_ == end_ || is_line_end(*at_);
  }
  void next_line();
  // Skips blanks, line ends and comments up to the line end, as free-form formats have them.
  void skip_space(char comment);

  // The next word of this line; empty when the line is over.
  [[nodiscard]] std::string_view word();
  // The next word without moving.
  [[nodiscard]] std::string_view peek_word();
  // The rest of the line without blanks at either end; continued lines are joined by a blank. Stays before the line end.
  [[nodiscard]] std::string rest_of_line();
  // The next number of this line. False, without moving, when the line is over or the word is not wholly a number.
  [[nodiscard]] bool number(double& value);

  // FILE:LINE of a position, for messages.
  [[nodiscard]] std::string where(const char* position) const;
  [[nodiscard]] std::string where() const { return where(at_); }

 private:
  bool skip_continuation();
  const char *begin_, *at_, *end_;
  std::string path_;
  mutable const char* counted_to_ = begin_;  // lines are counted on from the last place asked for
  mutable std::int64_t line_ = 1;
};

// A piece of the input for a message: shortened, unprintable bytes as '?'.
[[nodiscard]] std::string shown_as(std::string_view text);

}  // namespace texel
