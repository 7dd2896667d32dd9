#include "formats/xml.h"

#include <expat.h>

#include <algorithm>
#include <exception>
#include <memory>
#include <new>

#include "formats/error.h"

namespace texel {
namespace {

constexpr std::size_t kChunk = std::size_t{1} << 20, kLongestMark = std::size_t{16} << 20;
constexpr std::int64_t kDeepest = std::int64_t{1} << 20;

}  // namespace

const char* XmlAttributes::find(std::string_view name) const {
  for (const char* const* at = pairs_; *at; at += 2)
    if (name == at[0]) return at[1];
  return nullptr;
}

// Expat's side. It is C: nothing may be thrown through it, so an exception waits in `thrown` until it has returned.
struct XmlParser::Calls {
  XmlParser& self;
  XmlHandler& handler;
  std::exception_ptr thrown;
  std::int64_t depth = 0;
  bool moved = false;  // something was read of the current chunk

  template <class Call>
  static void guarded(void* user, Call call) {
    Calls& calls = *static_cast<Calls*>(user);
    calls.moved = true;
    if (calls.thrown) return;
    try {
      call(calls);
    } catch (...) {
      calls.thrown = std::current_exception();
      XML_StopParser(static_cast<XML_Parser>(calls.self.parser_), XML_FALSE);
    }
  }
  static void XMLCALL start(void* user, const XML_Char* name, const XML_Char** pairs) {
    guarded(user, [&](Calls& c) {
      if (++c.depth > kDeepest) throw Error(Code::kBadInput, c.self.where(), "elements are nested more than " + std::to_string(kDeepest) + " deep");
      c.handler.start(c.self, name, XmlAttributes(pairs));
    });
  }
  static void XMLCALL end(void* user, const XML_Char*) {
    guarded(user, [](Calls& c) {
      --c.depth;
      c.handler.end(c.self);
    });
  }
  static void XMLCALL text(void* user, const XML_Char* piece, int length) {
    guarded(user, [&](Calls& c) { c.handler.text(c.self, {piece, static_cast<std::size_t>(length)}); });
  }
  static void XMLCALL doctype(void* user, const XML_Char*, const XML_Char*, const XML_Char*, int has_own_part) {
    guarded(user, [&](Calls& c) {
      if (has_own_part) throw Error(Code::kBadInput, c.self.where(), "declares a document type of its own ([...] after DOCTYPE), which is not read", "take it out");
    });
  }
  static void XMLCALL other(void* user, const XML_Char*, int) { static_cast<Calls*>(user)->moved = true; }
};

void XmlParser::run(XmlHandler& handler, Report& report) {
  const std::unique_ptr<XML_ParserStruct, void (*)(XML_Parser)> parser(XML_ParserCreate(nullptr), XML_ParserFree);
  if (!parser) throw std::bad_alloc();
  parser_ = parser.get();
  const std::unique_ptr<void*, void (*)(void**)> forget(&parser_, [](void** p) { *p = nullptr; });
  Calls calls{*this, handler, nullptr};
  XML_SetUserData(parser.get(), &calls);
  XML_SetElementHandler(parser.get(), Calls::start, Calls::end);
  XML_SetCharacterDataHandler(parser.get(), Calls::text);
  XML_SetStartDoctypeDeclHandler(parser.get(), Calls::doctype);
  XML_SetDefaultHandler(parser.get(), Calls::other);  // comments and the like; also keeps entities from being put in
  const std::span<const char> bytes = input_.bytes;
  std::size_t at = 0, moved_to = 0;
  do {
    const std::size_t size = std::min(kChunk, bytes.size() - at);
    calls.moved = false;
    const XML_Status status = XML_Parse(parser.get(), bytes.data() + at, static_cast<int>(size), at + size == bytes.size());
    if (calls.thrown) std::rethrow_exception(calls.thrown);
    if (status != XML_STATUS_OK) {
      const XML_Error error = XML_GetErrorCode(parser.get());
      if (error == XML_ERROR_NO_MEMORY) throw std::bad_alloc();
      throw Error(Code::kBadInput, where(), std::string("is not well-formed XML (") + XML_ErrorString(error) + ")");
    }
    at += size;
    if (calls.moved) moved_to = at;
    if (at - moved_to > kLongestMark) throw Error(Code::kBadInput, where(), "a single tag or comment takes more than 16 MiB");
    if (report.progress) report.progress("read", static_cast<double>(at) / static_cast<double>(std::max<std::size_t>(bytes.size(), 1)));
  } while (at < bytes.size());
}

std::uint64_t XmlParser::line() const { return parser_ ? XML_GetCurrentLineNumber(static_cast<XML_Parser>(parser_)) : 0; }
std::string XmlParser::where() const { return where(line()); }

std::string_view xml_root(std::string_view bytes) {
  bytes = bytes.substr(0, 65536);
  if (bytes.starts_with("\xEF\xBB\xBF")) bytes.remove_prefix(3);
  const auto skip_past = [&](std::string_view end) {
    const std::size_t at = bytes.find(end);
    bytes.remove_prefix(at == std::string_view::npos ? bytes.size() : at + end.size());
  };
  for (;;) {
    while (!bytes.empty() && (is_blank(bytes.front()) || is_line_end(bytes.front()))) bytes.remove_prefix(1);
    if (bytes.starts_with("<?")) skip_past("?>");
    else if (bytes.starts_with("<!--")) skip_past("-->");
    else if (bytes.starts_with("<!")) skip_past(">");
    else break;
  }
  if (!bytes.starts_with("<")) return {};
  bytes.remove_prefix(1);
  return bytes.substr(0, std::min(bytes.size(), bytes.find_first_of(" \t\r\n/>")));
}

}  // namespace texel
