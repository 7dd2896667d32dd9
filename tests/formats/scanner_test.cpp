#include "formats/text_scanner.h"

#include <charconv>
#include <cmath>
#include <cstring>
#include <random>

#include "tests/formats/read_test_util.h"

namespace texel {
namespace {

double parsed(const std::string& text, std::size_t* used = nullptr) {
  double value = -12345;
  const char* end = parse_number(text.data(), text.data() + text.size(), value);
  if (used) *used = end ? static_cast<std::size_t>(end - text.data()) : 0;
  return value;
}

// Exact: both are correctly rounded, so the bits are the library's.
TEST(Number, HasTheBitsOfTheLibrary) {
  std::mt19937_64 random(1);
  for (int i = 0; i < 200000; ++i) {
    char text[64];
    const double mantissa = std::ldexp(static_cast<double>(random() >> 11), -53) * 2 - 1;
    const double value = mantissa * std::pow(10.0, static_cast<double>(random() % 60) - 30);
    const int digits = static_cast<int>(random() % 20);
    const int length = i % 2 ? std::snprintf(text, sizeof text, "%.*g", digits, value) : std::snprintf(text, sizeof text, "%.*e", digits, value);
    double expected = 0;
    std::from_chars(text, text + length, expected);
    double read = 0;
    ASSERT_EQ(parse_number(text, text + length, read), text + length) << text;
    ASSERT_EQ(std::memcmp(&read, &expected, sizeof read), 0) << text;
  }
}

TEST(Number, ReadsWhatExportersWrite) {
  EXPECT_EQ(parsed("+1.5"), 1.5);
  EXPECT_EQ(parsed(".5"), 0.5);
  EXPECT_EQ(parsed("5."), 5.0);
  EXPECT_EQ(parsed(".8e-001"), 0.08);
  EXPECT_EQ(parsed("-.7e+02"), -70.0);
  EXPECT_EQ(parsed("00000000000000000000000000000012"), 12.0);
  EXPECT_EQ(parsed("1e99999999999999999999"), std::numeric_limits<double>::infinity());
  EXPECT_EQ(parsed("-1e999"), -std::numeric_limits<double>::infinity());
  EXPECT_EQ(parsed("1e-999"), 0.0);
  EXPECT_TRUE(std::isnan(parsed("nan")));
  EXPECT_TRUE(std::isinf(parsed("-inf")));
  std::size_t used = 0;
  EXPECT_EQ(parsed("2e", &used), 2.0);
  EXPECT_EQ(used, 1u);
  for (const char* none : {"", "-", ".", "e5", "x", "+-1", "++1"}) {
    (void)parsed(none, &used);
    EXPECT_EQ(used, 0u) << none;
  }
}

TEST(Scanner, RuntimeNanIsANumberAndOtherTailsAreNot) {
  const std::string text = "1.#IND -1.#INF 1.#QNAN 1x 2";
  TextScanner scanner({text, "t"});
  double v = 0;
  for (int i = 0; i < 3; ++i) {
    ASSERT_TRUE(scanner.number(v));
    EXPECT_TRUE(std::isnan(v));
  }
  EXPECT_FALSE(scanner.number(v));
  EXPECT_EQ(scanner.word(), "1x");
  EXPECT_TRUE(scanner.number(v));
  EXPECT_EQ(v, 2);
}

TEST(Scanner, AllLineEndsAndContinuations) {
  const std::string text = "a\nb\r\nc\rd \\\n e \\\r\nf\r\n\r\ng";
  TextScanner scanner({text, "file"});
  EXPECT_EQ(scanner.rest_of_line(), "a");
  scanner.next_line();
  EXPECT_EQ(scanner.rest_of_line(), "b");
  scanner.next_line();
  EXPECT_EQ(scanner.word(), "c");
  EXPECT_TRUE(scanner.line_is_over());
  scanner.next_line();
  EXPECT_EQ(scanner.where(), "file:4");
  EXPECT_EQ(scanner.word(), "d");
  EXPECT_EQ(scanner.word(), "e");
  EXPECT_EQ(scanner.word(), "f");
  EXPECT_EQ(scanner.where(), "file:6");
  EXPECT_TRUE(scanner.line_is_over());
  scanner.next_line();
  EXPECT_TRUE(scanner.line_is_over());
  scanner.next_line();
  EXPECT_EQ(scanner.where(), "file:8");
  EXPECT_EQ(scanner.word(), "g");
  EXPECT_TRUE(scanner.at_end());
  EXPECT_EQ(scanner.where(text.data()), "file:1");
}

TEST(Scanner, BackslashesInNamesStay) {
  const std::string text = "textures\\leaf one.png";
  TextScanner scanner({text, "t"});
  EXPECT_EQ(scanner.rest_of_line(), text);
}

TEST(FileBytes, EmptyMissingAndFolder) {
  const TestFolder folder;
  EXPECT_TRUE(FileBytes(folder.write("empty", "")).bytes().empty());
  const FileBytes some(folder.write("some", "abc"));
  EXPECT_EQ(std::string(some.bytes().data(), some.bytes().size()), "abc");
  EXPECT_EQ(error_of([&] { FileBytes(folder.file("none")); }), "2: " + folder.file("none") + ": cannot be read (No such file or directory)");
  EXPECT_EQ(error_of([&] { FileBytes(folder.file("")); }), "2: " + folder.file("") + ": is a folder");
}

}  // namespace
}  // namespace texel
