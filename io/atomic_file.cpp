// Write aside, flush, rename.
#include <lamina/io/atomic_file.hpp>

#include <fcntl.h>
#include <unistd.h>

#include <fstream>
#include <string>

#include <lamina/models/error.hpp>

namespace lamina::io {
namespace {

// The hidden file beside; what is left of it goes, whatever ended the writing.
struct Aside {
  explicit Aside(const std::filesystem::path& file) : path(file) {
    std::string name = ".";  // "." + text warns falsely in GCC 12 (its bug 105329)
    name += file.filename().string();
    path.replace_filename(name + ".part");
  }
  ~Aside() {
    std::error_code ignored;
    std::filesystem::remove(path, ignored);
  }
  Aside(const Aside&) = delete;
  Aside& operator=(const Aside&) = delete;
  std::filesystem::path path;
};

void flush_to_disk(const std::filesystem::path& path) {
  const int descriptor = ::open(path.c_str(), O_RDONLY);
  if (descriptor < 0) return;
  ::fsync(descriptor);
  ::close(descriptor);
}

}  // namespace

void write_atomically(const std::filesystem::path& file,
                      const std::function<void(std::ostream&)>& write) {
  Aside aside(file);
  {
    std::ofstream out(aside.path, std::ios::binary | std::ios::trunc);
    if (!out) throw Error(file.string() + ": cannot be written, expected a writable folder");
    write(out);
    out.flush();
    if (!out) throw Error(file.string() + ": writing failed, is the disk full?");
  }
  flush_to_disk(aside.path);
  std::error_code error;
  std::filesystem::rename(aside.path, file, error);
  if (error) throw Error(file.string() + ": cannot be replaced (" + error.message() + ")");
}

void write_atomically(const std::filesystem::path& file, std::string_view content) {
  write_atomically(file, [content](std::ostream& out) {
    out.write(content.data(), static_cast<std::streamsize>(content.size()));
  });
}

void make_output_folder(const std::filesystem::path& folder) {
  if (folder.empty()) throw Error("--output: found nothing, expected a folder to write to");
  std::error_code error;
  if (std::filesystem::exists(folder, error) && !std::filesystem::is_directory(folder, error)) {
    throw Error(folder.string() + ": found a file, expected a folder to write to");
  }
  std::filesystem::create_directories(folder, error);
  if (error || !std::filesystem::is_directory(folder)) {
    throw Error(folder.string() + ": cannot be made (" + error.message() +
                "), expected a folder to write to");
  }
}

void make_results_folder(const std::filesystem::path& folder) {
  if (std::filesystem::exists(folder / "calibration.yaml")) {
    throw Error(folder.string() +
                ": found a recording there (calibration.yaml), expected a folder for results");
  }
  make_output_folder(folder);
}

}  // namespace lamina::io
