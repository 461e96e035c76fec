// `lamina map --live`: pictures of the run for the page in a browser.
#pragma once

#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include <lamina/backend/mapper/mapper.hpp>
#include <lamina/frontend/frontend.hpp>
#include <lamina/models/diagnostics.hpp>
#include <lamina/viewer/live_server.hpp>

namespace lamina::apps {

/// Nothing here waits for a browser: pictures are taken only while one looks on, at most once a
/// second and for at most a twentieth of the time, and a thread of its own makes text of the
/// latest.
class LivePage {
 public:
  /// `where`: [ADDRESS:]PORT, or empty. Throws lamina::Error when it cannot listen there.
  LivePage(const std::string& where, std::string recording);
  ~LivePage();
  LivePage(const LivePage&) = delete;
  LivePage& operator=(const LivePage&) = delete;

  std::string url() const { return server_.url(); }
  /// Measurements so far, of how many (nullopt: not known).
  void progress(std::int64_t done, std::optional<std::int64_t> total);
  /// A step that is not mapped yet: the path by dead reckoning.
  void read(const Step& step, const Diagnostics& metrics);
  void mapped(const Step& step, const Mapper& mapper, const Diagnostics& metrics);
  void refining(const Mapper& mapper, const Diagnostics& metrics);
  /// The results are in `folder`: shows them, and gives a page that looks on a few seconds to ask.
  void finished(const std::filesystem::path& folder);

 private:
  using Clock = std::chrono::steady_clock;
  struct Ends {  // of the beams of one scan
    Timestamp stamp;
    std::vector<Eigen::Vector3f> points_body;
  };
  struct Picture;

  bool due() const;
  void keep(const Step& step);
  std::unique_ptr<Picture> begin(const char* doing, const Diagnostics& metrics) const;
  void transfer(std::unique_ptr<Picture> picture, Clock::time_point since);
  void encode();
  void stop();
  double seconds() const;

  viewer::LiveServer server_;
  std::string recording_;
  Clock::time_point start_ = Clock::now(), last_ = start_ - std::chrono::hours(1);
  double cost_s_ = 0;  // of the last picture
  std::int64_t done_ = 0, total_ = 0;
  Trajectory path_;  // dead reckoning
  std::vector<std::shared_ptr<const Ends>> scans_;
  std::size_t points_ = 0;

  std::mutex mutex_;
  std::condition_variable news_;
  std::unique_ptr<Picture> next_;  // the latest that is not text yet
  bool stop_ = false;
  std::thread encoder_;
};

}  // namespace lamina::apps
