#include "formats/text_scanner.h"

#include <fcntl.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <charconv>
#include <cstring>
#include <limits>

#include "formats/error.h"

namespace texel {
namespace {

struct Descriptor {
  int fd;
  explicit Descriptor(const std::string& path) : fd(::open(path.c_str(), O_RDONLY | O_CLOEXEC)) {}
  ~Descriptor() {
    if (fd >= 0) ::close(fd);
  }
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;
};

Error cannot_read(const std::string& path, int reason) {
  return {Code::kFile, path, std::string("cannot be read (") + std::strerror(reason) + ")"};
}

std::unique_ptr<char[]> read_all(int fd, const std::string& path, std::size_t& size) {
  std::size_t room = std::size_t{1} << 16;
  auto bytes = std::make_unique<char[]>(room);
  size = 0;
  for (;;) {
    const ssize_t got = ::read(fd, bytes.get() + size, room - size);
    if (got < 0 && errno == EINTR) continue;
    if (got < 0) throw cannot_read(path, errno);
    if (got == 0) return bytes;
    size += static_cast<std::size_t>(got);
    if (size < room) continue;
    auto larger = std::make_unique<char[]>(room * 2);
    std::memcpy(larger.get(), bytes.get(), size);
    bytes = std::move(larger);
    room *= 2;
  }
}

// Powers of ten a double holds exactly.
constexpr std::array<double, 23> kPowers = {1e0,  1e1,  1e2,  1e3,  1e4,  1e5,  1e6,  1e7,  1e8,  1e9,  1e10, 1e11,
                                            1e12, 1e13, 1e14, 1e15, 1e16, 1e17, 1e18, 1e19, 1e20, 1e21, 1e22};

// Everything the quick path leaves: many digits, large exponents, words.
const char* parse_slowly(const char* at, const char* end, double& value) {
  if (at != end && *at == '+') {
    ++at;
    if (at != end && (*at == '-' || *at == '+')) return nullptr;
  }
  const std::from_chars_result result = std::from_chars(at, end, value);
  if (result.ec == std::errc::invalid_argument) return nullptr;
  if (result.ec == std::errc::result_out_of_range) {
    // The library doesn't say on which side. A negative exponent, or a number that begins with 0, is too small; others are too large.
    const char* first = *at == '-' ? at + 1 : at;
    const std::string_view text(first, static_cast<std::size_t>(result.ptr - first));
    const std::size_t e = text.find_first_of("eE");
    const bool small = e == std::string_view::npos ? text.front() == '0' || text.front() == '.' : text.substr(e + 1, 1) == "-";
    value = small ? 0.0 : std::numeric_limits<double>::infinity();
    if (*at == '-') value = -value;
  }
  return result.ptr;
}

// Old C runtimes print what is not a number as 1.#IND, 1.#INF, 1.#QNAN. `at` is at the '#'.
const char* skip_runtime_nan(const char* at, const char* end) {
  const char* p = at + 1;
  while (p != end && *p >= 'A' && *p <= 'Z') ++p;
  return p - at >= 4 ? p : nullptr;
}

}  // namespace

FileBytes::FileBytes(const std::string& path) {
  const Descriptor file(path);
  if (file.fd < 0) throw cannot_read(path, errno);
  struct stat status{};
  if (::fstat(file.fd, &status) != 0) throw cannot_read(path, errno);
  if (S_ISDIR(status.st_mode)) throw Error(Code::kFile, path, "is a folder");
  const auto size = static_cast<std::size_t>(status.st_size);
  if (S_ISREG(status.st_mode) && size > 0) {
    void* mapped = ::mmap(nullptr, size, PROT_READ, MAP_PRIVATE, file.fd, 0);
    if (mapped != MAP_FAILED) {
      ::madvise(mapped, size, MADV_SEQUENTIAL);
      bytes_ = {static_cast<const char*>(mapped), size};
      return;
    }
  }
  std::size_t got = 0;
  copy_ = read_all(file.fd, path, got);
  bytes_ = {copy_.get(), got};
}

FileBytes::~FileBytes() {
  if (!copy_ && !bytes_.empty()) ::munmap(const_cast<char*>(bytes_.data()), bytes_.size());
}

const char* parse_number(const char* at, const char* end, double& value) {
  const char* p = at;
  const bool negative = p != end && *p == '-';
  if (p != end && (*p == '-' || *p == '+')) ++p;
  std::uint64_t mantissa = 0;
  const char* whole = p;
  for (; p != end && is_digit(*p); ++p) mantissa = mantissa * 10 + static_cast<std::uint64_t>(*p - '0');
  std::ptrdiff_t digits = p - whole;
  std::ptrdiff_t exponent = 0;
  if (p != end && *p == '.') {
    const char* fraction = ++p;
    for (; p != end && is_digit(*p); ++p) mantissa = mantissa * 10 + static_cast<std::uint64_t>(*p - '0');
    exponent = fraction - p;
    digits -= exponent;
  }
  if (digits == 0 || digits > 19) return parse_slowly(at, end, value);
  if (p != end && (*p == 'e' || *p == 'E')) {
    const char* e = p + 1;
    const bool minus = e != end && *e == '-';
    if (e != end && (*e == '-' || *e == '+')) ++e;
    const char* first = e;
    std::ptrdiff_t written = 0;
    for (; e != end && is_digit(*e); ++e) written = std::min<std::ptrdiff_t>(written * 10 + (*e - '0'), 100000);
    if (e != first) {
      exponent += minus ? -written : written;
      p = e;
    }
  }
  // Clinger's case: both numbers are exact, so one multiplication or division rounds correctly.
  if (mantissa > (std::uint64_t{1} << 53) || exponent < -22 || exponent > 22) return parse_slowly(at, end, value);
  const double exact = static_cast<double>(mantissa);
  const double magnitude = exponent < 0 ? exact / kPowers[static_cast<std::size_t>(-exponent)] : exact * kPowers[static_cast<std::size_t>(exponent)];
  value = negative ? -magnitude : magnitude;
  return p;
}

bool TextScanner::skip_continuation() {
  const char* p = at_ + 1;
  if (p == end_ || !is_line_end(*p)) return false;
  at_ = *p == '\r' && p + 1 != end_ && p[1] == '\n' ? p + 2 : p + 1;
  return true;
}

void TextScanner::next_line() {
  while (at_ != end_ && !is_line_end(*at_)) ++at_;
  if (at_ == end_) return;
  at_ += *at_ == '\r' && at_ + 1 != end_ && at_[1] == '\n' ? 2 : 1;
}

void TextScanner::skip_space(char comment) {
  while (at_ != end_) {
    if (is_blank(*at_) || is_line_end(*at_)) ++at_;
    else if (*at_ == comment) next_line();
    else return;
  }
}

std::string_view TextScanner::word() {
  skip_blanks();
  const char* first = at_;
  while (at_ != end_ && !is_blank(*at_) && !is_line_end(*at_)) ++at_;
  return {first, static_cast<std::size_t>(at_ - first)};
}

std::string_view TextScanner::peek_word() {
  const char* keep = at_;
  const std::string_view text = word();
  at_ = keep;
  return text;
}

std::string TextScanner::rest_of_line() {
  skip_blanks();
  std::string text;
  while (at_ != end_ && !is_line_end(*at_)) {
    if (*at_ == '\\' && skip_continuation()) text += ' ';
    else text += *at_++;
  }
  while (!text.empty() && is_blank(text.back())) text.pop_back();
  return text;
}

bool TextScanner::number(double& value) {
  skip_blanks();
  double read = 0;
  const char* p = parse_number(at_, end_, read);
  if (!p) return false;
  if (p != end_ && *p == '#' && p[-1] == '.') {
    p = skip_runtime_nan(p, end_);
    if (!p) return false;
    read = std::numeric_limits<double>::quiet_NaN();
  }
  if (p != end_ && !is_blank(*p) && !is_line_end(*p) && *p != '\\' && *p != '#') return false;
  value = read;
  at_ = p;
  return true;
}

std::string TextScanner::where(const char* position) const {
  if (position < counted_to_) {
    counted_to_ = begin_;
    line_ = 1;
  }
  for (; counted_to_ != position; ++counted_to_)
    if (*counted_to_ == '\n' || (*counted_to_ == '\r' && (counted_to_ + 1 == end_ || counted_to_[1] != '\n'))) ++line_;
  return path_ + ":" + std::to_string(line_);
}

std::string shown_as(std::string_view text) {
  constexpr std::size_t kLongest = 60;
  std::string shown = "\"";
  for (const char c : text.substr(0, kLongest)) shown += static_cast<unsigned char>(c) < 32 || c == 127 ? '?' : c;
  shown += text.size() > kLongest ? "…\"" : "\"";
  return shown;
}

}  // namespace texel
