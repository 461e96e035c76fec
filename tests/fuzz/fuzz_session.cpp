// What stands in a session.lamina behind its header: what reads is sound, keeps its bytes, and can
// be worked with. The seed is half a second of the simulated room by 24 beams a scan, without the
// header (first 32 bytes); made anew whenever the version rises.
#include <lamina/io/session_archive.hpp>
#include <lamina/models/error.hpp>

#include "fuzz/fuzz_input.hpp"

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using lamina::fuzz::demand;
  try {
    const std::string_view content = lamina::fuzz::text_of(data, size);
    lamina::io::Session session = lamina::io::parse_session(content, "session.lamina");
    demand(session.map.problems().empty());
    const std::string bytes = lamina::io::session_content(session);
    const lamina::io::Session again = lamina::io::parse_session(bytes, "session.lamina");
    demand(lamina::io::session_content(again) == bytes);
    for (const lamina::MapFrame& frame : session.map.frames) {
      demand(session.map.graph.find(frame.keyframe) != nullptr);
    }
    session.shift_time(1);
    lamina::append(session.map, again.map, {});  // as joining does
  } catch (const lamina::Error&) {
  }
  return 0;
}
