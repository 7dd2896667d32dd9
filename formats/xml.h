#pragma once
// XML, element by element, without a tree: files of hundreds of megabytes and elements nested a million deep take little memory.
#include <string>
#include <string_view>

#include "formats/report.h"
#include "formats/text_scanner.h"

namespace texel {

class XmlParser;

// The attributes of one element; valid until `start` returns.
class XmlAttributes {
 public:
  explicit XmlAttributes(const char* const* pairs) : pairs_(pairs) {}
  // The value; null where there is no such attribute.
  [[nodiscard]] const char* find(std::string_view name) const;

 private:
  const char* const* pairs_;
};

// What a reader does at each element. Text comes in pieces, cut anywhere; white space between elements too. May throw.
class XmlHandler {
 public:
  virtual ~XmlHandler() = default;
  virtual void start(const XmlParser& parser, std::string_view name, const XmlAttributes& attributes) = 0;
  virtual void text(const XmlParser& parser, std::string_view piece) = 0;
  virtual void end(const XmlParser& parser) = 0;  // of the innermost element
};

class XmlParser {
 public:
  explicit XmlParser(const Input& input) : input_(input) {}
  // Calls the handler in the order of the file; report.progress("read", share) now and then. Throws what the handler throws, and
  // Error{kBadInput} with FILE:LINE where the XML is malformed, declares its own entities or defaults (which can grow without end), nests
  // deeper than 2^20 elements or holds a tag, comment or other mark of over 16 MiB. UTF-8, UTF-16, Latin-1 and ASCII.
  void run(XmlHandler& handler, Report& report);
  // FILE:LINE of what the handler is called for.
  [[nodiscard]] std::string where() const;
  [[nodiscard]] std::string where(std::uint64_t line) const { return input_.path + ":" + std::to_string(line); }
  [[nodiscard]] std::uint64_t line() const;

 private:
  struct Calls;
  const Input& input_;
  void* parser_ = nullptr;
};

// The name of the outermost element as far as the first 64 KiB tell; empty: none.
[[nodiscard]] std::string_view xml_root(std::string_view bytes);

}  // namespace texel
