// Takes pictures of a run and hands them to the page's server.
#include <lamina/apps/live.hpp>

#include <nlohmann/json.hpp>

#include <lamina/io/figure_names.hpp>
#include <lamina/viewer/live_data.hpp>
#include <lamina/viewer/map_data.hpp>
#include <lamina/viewer/parts.hpp>

namespace lamina::apps {
namespace {

constexpr double kLooksOn = 10;  // s since a browser last asked
constexpr std::size_t kBeams = 120, kMostPoints = 400000;

// As metrics.json, of what is known already.
std::string metrics_text(const Diagnostics& metrics) {
  nlohmann::ordered_json json;
  json["stages"] = nlohmann::ordered_json::object();
  for (const auto& [name, stage] : metrics.stages) {
    json["stages"][name] = {{"calls", stage.calls()},
                            {"median_ms", stage.percentile_ms(50)},
                            {"p95_ms", stage.percentile_ms(95)}};
  }
  json["skipped"] = metrics.skipped;
  json["counts"] = io::by_name(metrics.counts);
  return json.dump(-1, ' ', true, nlohmann::json::error_handler_t::replace);
}

}  // namespace

struct LivePage::Picture {
  viewer::LivePicture shown;
  Diagnostics metrics;
  std::vector<std::shared_ptr<const Ends>> scans;
};

LivePage::LivePage(const std::string& where, std::string recording)
    : server_(viewer::LiveAddress::parse(where)),
      recording_(std::move(recording)),
      encoder_([this] { encode(); }) {}

LivePage::~LivePage() { stop(); }

void LivePage::stop() {
  {
    const std::lock_guard lock(mutex_);
    stop_ = true;
  }
  news_.notify_all();
  if (encoder_.joinable()) encoder_.join();
}

double LivePage::seconds() const {
  return std::chrono::duration<double>(Clock::now() - start_).count();
}

void LivePage::progress(std::int64_t done, std::optional<std::int64_t> total) {
  done_ = done;
  total_ = total.value_or(0);
}

bool LivePage::due() const {
  const double since = std::chrono::duration<double>(Clock::now() - last_).count();
  return since > std::max(1.0, 20 * cost_s_) && server_.wanted(kLooksOn);
}

// A hundred beams of each scan; of a long run every second scan, then every fourth.
void LivePage::keep(const Step& step) {
  if (!step.scan) return;
  const LaserScan& scan = *step.scan;
  auto ends = std::make_shared<Ends>();
  ends->stamp = scan.stamp;
  const std::size_t stride = std::max<std::size_t>(1, scan.size() / kBeams);
  for (std::size_t i = 0; i < scan.size(); i += stride) {
    if (!scan.valid(i)) continue;
    const Eigen::Vector2d p = scan.point(i);
    ends->points_body.push_back(
        (scan.lidar.T_body_lidar * Eigen::Vector3d(p.x(), p.y(), 0)).cast<float>());
  }
  points_ += ends->points_body.size();
  scans_.push_back(std::move(ends));
  if (points_ <= kMostPoints) return;
  points_ = 0;
  for (std::size_t i = 0; 2 * i < scans_.size(); ++i) {
    scans_[i] = scans_[2 * i];
    points_ += scans_[i]->points_body.size();
  }
  scans_.resize((scans_.size() + 1) / 2);
}

std::unique_ptr<LivePage::Picture> LivePage::begin(const char* doing,
                                                   const Diagnostics& metrics) const {
  auto picture = std::make_unique<Picture>();
  picture->shown.name = std::filesystem::path(recording_).filename().string();
  picture->shown.doing = doing;
  picture->shown.done = done_;
  picture->shown.total = total_;
  picture->shown.seconds = seconds();
  picture->metrics = metrics;
  picture->scans = scans_;
  return picture;
}

void LivePage::transfer(std::unique_ptr<Picture> picture, Clock::time_point since) {
  {
    const std::lock_guard lock(mutex_);
    next_ = std::move(picture);
  }
  news_.notify_all();
  last_ = Clock::now();
  cost_s_ = std::chrono::duration<double>(last_ - since).count();
}

void LivePage::read(const Step& step, const Diagnostics& metrics) {
  keep(step);
  path_.add(step.observations.stamp, step.T_start_body);
  if (!due()) return;
  const auto since = Clock::now();
  auto picture = begin("reading", metrics);
  picture->shown.map.trajectory = path_;
  transfer(std::move(picture), since);
}

void LivePage::mapped(const Step& step, const Mapper& mapper, const Diagnostics& metrics) {
  if (path_.empty()) keep(step);  // else the first pass has kept it
  if (!due()) return;
  refining(mapper, metrics);
}

void LivePage::refining(const Mapper& mapper, const Diagnostics& metrics) {
  if (!server_.wanted(kLooksOn)) return;
  const auto since = Clock::now();
  auto picture = begin(done_ == total_ && total_ > 0 ? "refining" : "mapping", metrics);
  picture->shown.map = mapper.map();
  for (const Keyframe& keyframe : mapper.graph().keyframes) {
    picture->shown.keyframes.push_back(keyframe.T_map_body);
  }
  transfer(std::move(picture), since);
}

// The encoder's thread.
void LivePage::encode() {
  while (true) {
    std::unique_ptr<Picture> picture;
    {
      std::unique_lock lock(mutex_);
      news_.wait(lock, [this] { return stop_ || next_; });
      if (stop_) return;
      picture = std::move(next_);
    }
    viewer::PointCloud cloud;
    for (const auto& scan : picture->scans) {
      const auto T_map_body = picture->shown.map.trajectory.at(scan->stamp);
      if (!T_map_body) continue;
      const Eigen::Isometry3f T(T_map_body->matrix().cast<float>());
      for (const auto& p : scan->points_body) cloud.add(T * p);
    }
    picture->shown.points_map = cloud.points();
    picture->shown.metrics = metrics_text(picture->metrics);
    server_.publish(viewer::live_data(picture->shown));
  }
}

void LivePage::finished(const std::filesystem::path& folder) {
  stop();  // else a picture that is late would come after the last one
  server_.publish(viewer::finished_data(viewer::map_data(folder),
                                        folder.lexically_normal().string(), seconds()));
  if (server_.wanted(kLooksOn)) server_.wait_until_fetched(15);  // machines are busy
}

}  // namespace lamina::apps
