// Finds and loads the plug-in of Cyclone DDS.
#include <lamina/sensors/dds/wire.hpp>

#include <dlfcn.h>

#include <cstdlib>
#include <filesystem>
#include <optional>

#include <lamina/models/error.hpp>

namespace lamina::dds {
namespace {

namespace fs = std::filesystem;

constexpr const char* kPlugin = "lamina_dds.so";

// Beside the program, as it was built; where it is installed.
std::vector<fs::path> places() {
  std::error_code error;
  const fs::path program = fs::read_symlink("/proc/self/exe", error).parent_path();
  return {program / kPlugin, program.parent_path() / "lib" / "lamina" / kPlugin,
          fs::path(LAMINA_BUILT_PLUGINS) / kPlugin, fs::path(LAMINA_INSTALLED_PLUGINS) / kPlugin};
}

}  // namespace

int domain_of_environment() {
  const char* text = std::getenv("ROS_DOMAIN_ID");
  if (text == nullptr || *text == '\0') return 0;
  char* end = nullptr;
  const long domain = std::strtol(text, &end, 10);
  if (*end != '\0' || domain < 0 || domain > kLastDomain)
    throw Error(std::string("ROS_DOMAIN_ID: found '") + text + "', expected 0 to " +
                std::to_string(kLastDomain));
  return static_cast<int>(domain);
}

std::unique_ptr<Wire> open_wire(int domain) {
  std::string why = "no " + std::string(kPlugin);
  for (const fs::path& file : places()) {
    std::error_code error;
    if (!fs::exists(file, error)) continue;
    void* library = ::dlopen(file.c_str(), RTLD_NOW | RTLD_LOCAL);
    void* symbol = library != nullptr ? ::dlsym(library, kMakeWire) : nullptr;
    if (symbol == nullptr) {
      const char* reason = ::dlerror();
      why = reason != nullptr ? reason : file.string();
      continue;
    }
    std::string wrong;
    const auto make = reinterpret_cast<MakeWire>(symbol);
    if (Wire* wire = make(domain, &wrong)) return std::unique_ptr<Wire>(wire);
    throw Error("ros2: domain " + std::to_string(domain) + ": " + wrong);
  }
  throw Error("ros2: found no DDS (" + why +
              "), expected Cyclone DDS: install cyclonedds-dev and build lamina again");
}

}  // namespace lamina::dds
