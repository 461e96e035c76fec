// Serves the report's page while a map grows.
#pragma once

#include <memory>
#include <string>

namespace lamina::viewer {

/// Where `lamina map --live [ADDRESS:]PORT` listens.
struct LiveAddress {
  std::string address = "127.0.0.1";  ///< loopback: other machines reach it only when told
  int port = 8765;                    ///< 0: any free one
  bool port_named = false;            ///< false: another port is taken when this one is in use

  /// "" (the default), "8080", ":8080", "0.0.0.0:8080", "[::1]:8080". Throws lamina::Error.
  static LiveAddress parse(const std::string& text);
};

/// GET / is the page, GET /data?after=N the data when they are newer than version N (204 when not).
/// Answers come from threads of its own: publish() never waits for a browser. Bound to loopback it
/// answers only requests addressed to this machine by name or number, so that no page from
/// elsewhere can read the map through the visitor's browser.
class LiveServer {
 public:
  /// Listens from here on. Throws lamina::Error when the address cannot be had.
  explicit LiveServer(const LiveAddress& where);
  ~LiveServer();
  LiveServer(const LiveServer&) = delete;
  LiveServer& operator=(const LiveServer&) = delete;

  std::string url() const;
  /// JSON text of the page's data. What was there before is forgotten.
  void publish(std::string data);
  /// A browser asked within the last `seconds`.
  bool wanted(double seconds) const;
  /// Waits until the newest data were fetched, `seconds` at most: after a run, so that the page of
  /// who looks on ends with the finished map.
  void wait_until_fetched(double seconds);

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace lamina::viewer
