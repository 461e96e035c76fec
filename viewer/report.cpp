// Puts a map's data into the page.
#include <lamina/viewer/report.hpp>

#include <ostream>
#include <string>

#include <lamina/io/atomic_file.hpp>
#include <lamina/models/error.hpp>
#include <lamina/viewer/map_data.hpp>
#include <lamina/viewer/page.hpp>

namespace lamina::viewer {
namespace {

/// Inside <script> no "</script" and no "<!--" may stand; in JSON a '<' only stands in strings.
std::string for_script(const std::string& json) {
  std::string text;
  text.reserve(json.size());
  for (const char c : json) {
    if (c == '<') {
      text += "\\u003c";
    } else {
      text += c;
    }
  }
  return text;
}

}  // namespace

std::string live_page() {
  std::string page(page_template());
  const auto put = [&](std::string_view mark, const std::string& text) {
    const auto at = page.find(mark);
    LAMINA_CHECK(at != std::string::npos);
    page.replace(at, mark.size(), text);
  };
  put(kDataMark, R"({"live":{"doing":"waiting"},"name":"","planes":[]})");
  // From the disk nothing may be asked for; here the server the page came from, and no other.
  put(kPolicyMark, "default-src 'none'; connect-src 'self'");
  return page;
}

void write_report(const std::filesystem::path& map_folder) {
  const std::string data = for_script(map_data(map_folder));
  const std::string_view page = page_template();
  const auto mark = page.find(kDataMark);
  LAMINA_CHECK(mark != std::string_view::npos);
  io::write_atomically(map_folder / "report.html", [&](std::ostream& out) {
    out << page.substr(0, mark) << data << page.substr(mark + kDataMark.size());
  });
}

}  // namespace lamina::viewer
