#include "formats/module.h"

#include <dlfcn.h>

#include <cstdlib>
#include <filesystem>
#include <map>
#include <mutex>
#include <vector>

#include "formats/error.h"

namespace texel {
namespace {

namespace fs = std::filesystem;

std::vector<fs::path> places() {
  std::vector<fs::path> found;
  if (const char* dir = std::getenv("TEXEL_MODULE_DIR")) found.emplace_back(dir);
  std::error_code ec;
  const fs::path program = fs::read_symlink("/proc/self/exe", ec).parent_path();
  if (!ec) {
    found.push_back(program);
    found.push_back(program / ".." / "lib" / "texel");
  }
  found.emplace_back(TEXEL_INSTALL_MODULE_DIR);
  return found;
}

fs::path find_module(const std::string& name) {
  std::string tried;
  for (const fs::path& place : places()) {
    const fs::path file = place / (name + ".so");
    std::error_code ec;
    if (fs::exists(file, ec)) return file;
    tried += (tried.empty() ? "" : ", ") + place.string();
  }
  throw Error(Code::kUnsupported, name + ".so", "module not found in " + tried, "set TEXEL_MODULE_DIR to its folder");
}

void* open_module(const std::string& name) {
  const fs::path file = find_module(name);
  if (void* handle = dlopen(file.c_str(), RTLD_NOW | RTLD_LOCAL)) return handle;
  throw Error(Code::kUnsupported, file.string(), std::string("cannot be loaded (") + dlerror() + ")", "install the libraries it needs");
}

}  // namespace

void* module_symbol(const std::string& name, const std::string& symbol) {
  // The one mutable static of the library: a process can open a module only once, whoever asks.
  static std::mutex mutex;
  static std::map<std::string, void*> open;
  const std::lock_guard lock(mutex);
  void*& handle = open[name];
  if (!handle) handle = open_module(name);
  void* address = dlsym(handle, symbol.c_str());
  if (!address) throw Error(Code::kUnsupported, name + ".so", "has no " + symbol, "reinstall texel: program and module differ in version");
  return address;
}

void require_module(const std::string& name) { (void)find_module(name); }

}  // namespace texel
