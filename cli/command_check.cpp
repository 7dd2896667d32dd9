// texel check: is a pack whole?
#include <nlohmann/json.hpp>

#include "cli/commands.h"
#include "cli/print.h"
#include "formats/error.h"
#include "formats/read_pack.h"

namespace texel {

int command_check(const Settings& settings) {
  const std::string& folder = only_input(settings, "PACK");
  const std::vector<CheckFinding> findings = check_pack(folder);
  std::string text;
  if (settings.json) {
    nlohmann::ordered_json j{{"pack", folder}, {"whole", findings.empty()}, {"findings", nlohmann::ordered_json::array()}};
    for (const CheckFinding& f : findings) j["findings"].push_back({{"id", f.id}, {"file", f.file}, {"text", f.text}});
    text = j.dump(2, ' ', false, nlohmann::ordered_json::error_handler_t::replace) + "\n";
  } else {
    for (const CheckFinding& f : findings) text += "[" + f.id + "] " + (f.file.empty() ? "" : f.file + ": ") + f.text + "\n";
    if (findings.empty()) text = folder + ": whole\n";
  }
  print_product(text);
  return static_cast<int>(findings.empty() ? Code::kOk : Code::kDifference);
}

}  // namespace texel
