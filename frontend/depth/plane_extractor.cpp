// Region of interest -> sub-sections -> outliers -> recursive RANSAC -> whole planes -> labels.
#include <lamina/frontend/depth/plane_extractor.hpp>

#include <algorithm>
#include <chrono>
#include <cmath>

#include <lamina/frontend/depth/dominant_floor.hpp>
#include <lamina/frontend/depth/edge_evidence.hpp>
#include <lamina/frontend/depth/leveling.hpp>
#include <lamina/frontend/depth/surface_test.hpp>
#include <lamina/models/stopwatch.hpp>

namespace lamina {
namespace {

constexpr double kDegree = M_PI / 180;

}  // namespace

void PlaneExtractor::estimate_noise(const DepthNoise& model) {
  // Quantisation is uniform over its step: step^2 / 12.
  const double nominal = std::sqrt(model.disparity_sigma * model.disparity_sigma +
                                   model.disparity_step * model.disparity_step / 12);
  // A real camera that is said to be ideal is noisier by far than any that is said to be real.
  const double most = model.kind == DepthNoise::Kind::kIdeal ? 20 : 4;
  noise_scale_ = lamina::noise_scale(blocks_, std::max(nominal, 1e-4), most);
  const double sigma = std::max(nominal, 1e-4) * noise_scale_;
  noise_.pixel = sigma * sigma;
  noise_.per_pixel = noise_.pixel * std::max(1.0, model.pixels_per_sample());
  noise_.shared = noise_.local = model.disparity_floor * model.disparity_floor;
}

void PlaneExtractor::extract(const DepthFrame& frame, const MountingPrior& prior) {
  times_ = FloorStageTimes();
  skipped_.clear();
  Stopwatch watch;
  fill_disparity(frame, image_);
  geometry_ = DisparityGeometry::of(frame.camera);
  times_.disparity_ms = watch.lap();

  fill_blocks(image_, geometry_, options_.block_px, blocks_);
  estimate_noise(frame.camera.noise);
  const double sigma = std::sqrt(noise_.pixel);
  const double block_pixels = options_.block_px * options_.block_px;
  remove_outliers(image_, geometry_,
                  static_cast<float>(options_.outlier_alpha * sigma * std::sqrt(1.5)),
                  static_cast<float>(sigma),
                  static_cast<float>(options_.min_block_fill * block_pixels), blocks_);
  noise_.shared = shared_variance(blocks_, noise_.per_pixel / block_pixels, noise_.shared);
  times_.blocks_ms = watch.lap();

  regions_.start(blocks_, geometry_, noise_, options_.distance_sigmas);
  first_look(prior);
  assign_sections();
  const Eigen::Vector3d up_camera =
      T_level_camera_.so3().inverse() * Eigen::Vector3d(Eigen::Vector3d::UnitZ());
  extract_floor_sections({up_camera, std::cos(options_.prior_cone_deg * kDegree)});
  extract_rest();
  regions_.merge(up_camera);
  regions_.settle_borders(2);
  regions_.merge(up_camera);
  regions_.keep_largest(0.5 * options_.min_plane_px);
  times_.planes_ms = watch.lap();

  labeller_.label(image_, geometry_, blocks_, static_cast<float>(sigma), regions_, pixel_labels_);
  drop_doubtful(static_cast<float>(6 * sigma));
  times_.refine_ms = watch.lap();
}

// Regions that are no surfaces leave; their pixels belong to nothing.
void PlaneExtractor::drop_doubtful(float gate) {
  constexpr int kStep = 8;  // rows and columns looked at: one a block
  const auto evidence =
      gather_evidence(image_, geometry_, pixel_labels_, regions_.regions(), kStep, gate);
  std::vector<bool> wanted;
  for (std::size_t k = 0; k < evidence.size(); ++k) {
    const bool left = regions_.regions()[k].sums.n >= 0.25 * options_.min_plane_px;
    wanted.push_back(left && is_surface(evidence[k], misfit(regions_.regions()[k], noise_)) &&
                     !is_edge(k, evidence[k].across.length(), evidence[k].down.length()));
  }
  if (std::find(wanted.begin(), wanted.end(), false) == wanted.end()) return;
  labeller_.rename(regions_.keep(wanted));
}

// Whether a region is but the blocks that hold two others' border: no more than two in width.
// `across`, `down`: mean length of its runs (px) along rows and columns.
bool PlaneExtractor::is_edge(std::size_t k, double across, double down) const {
  const int size = blocks_.size;
  if (std::min(across, down) > 2 * size) return false;
  int c0 = blocks_.columns, c1 = 0, r0 = blocks_.rows, r1 = 0;
  const auto labels = regions_.labels();
  for (int r = 0; r < blocks_.rows; ++r) {
    const std::int16_t* const row = labels.data() + blocks_.index(0, r);
    // Narrow as it is, most rows hold none of it.
    unsigned any = 0;
    for (int c = 0; c < blocks_.columns; ++c) any |= row[c] == static_cast<int>(k);
    if (any == 0) continue;
    for (int c = 0; c < blocks_.columns; ++c) {
      if (row[c] != static_cast<int>(k)) continue;
      c0 = std::min(c0, c);
      c1 = std::max(c1, c + 1);
      r0 = std::min(r0, r);
      r1 = r + 1;
    }
  }
  // Pixels go to planes of blocks up to two away.
  const PixelBox box{std::max(0, size * (c0 - 2)), std::min(image_.width, size * (c1 + 2)),
                     std::max(0, size * (r0 - 2)), std::min(image_.height, size * (r1 + 2))};
  return edge_evidence(image_, geometry_, pixel_labels_, regions_.regions(), k, box, across < down,
                       noise_.pixel)
      .is_edge();
}

// Where nothing is known of the mounting, the largest plane that may be a floor levels the frame,
// so that region of interest and sub-sections have a meaning.
void PlaneExtractor::first_look(const MountingPrior& prior) {
  T_level_camera_ = prior.T_body_camera;
  if (prior.known) return;
  std::vector<int> candidates;
  for (std::size_t i = 0; i < blocks_.blocks.size(); ++i) {
    if (blocks_.blocks[i].flat) candidates.push_back(static_cast<int>(i));
  }
  const Eigen::Vector3d up =
      prior.T_body_camera.so3().inverse() * Eigen::Vector3d(Eigen::Vector3d::UnitZ());
  Sampler sampler(options_.seed);
  BlockRansac ransac(blocks_, geometry_, noise_);
  const auto look = [&](double cone_deg, double least) {
    return ransac.best_plane(candidates, regions_.labels(), {up, std::cos(cone_deg * kDegree)},
                             2 * options_.distance_sigmas, 8 * options_.hypotheses, least, sampler);
  };
  auto found = look(options_.unknown_cone_deg, options_.min_plane_px);
  // A camera that looks steeply down sees its floor alone.
  if (!found) found = look(kSteepConeDeg, 0.5 * image_.width * image_.height);
  if (!found) return;
  if (const auto plane = geometry_.plane(found->plane)) {
    T_level_camera_ = leveled(prior.T_body_camera, *plane);
  }
}

void PlaneExtractor::assign_sections() {
  section_blocks_.resize(static_cast<std::size_t>(sections_.count()));
  for (auto& blocks : section_blocks_) blocks.clear();
  const Eigen::Matrix3d R = T_level_camera_.so3().matrix();
  const Eigen::Vector3d t = T_level_camera_.translation();
  for (std::size_t i = 0; i < blocks_.blocks.size(); ++i) {
    const Block& b = blocks_.blocks[i];
    if (!b.flat) continue;
    const int section = sections_.section_of(R * geometry_.point(b.u, b.v, b.d) + t);
    if (section >= 0) {
      section_blocks_[static_cast<std::size_t>(section)].push_back(static_cast<int>(i));
    }
  }
}

// The recursion of the document: the best plane, then the best of what is left, until none fits.
// A plane once found is followed over the whole frame, so that its other sections are spared.
void PlaneExtractor::recurse(std::vector<int>& candidates, const NormalPrior& prior,
                             Sampler& sampler) {
  BlockRansac ransac(blocks_, geometry_, noise_);
  for (int step = 0; step < options_.recursion_limit; ++step) {
    const auto labels = regions_.labels();
    std::erase_if(candidates, [&](int i) { return labels[static_cast<std::size_t>(i)] >= 0; });
    const double block_pixels = options_.block_px * options_.block_px;
    const double enough = std::max(3 * block_pixels, 0.25 * options_.min_plane_px);
    if (static_cast<double>(candidates.size()) * block_pixels < enough) return;
    const auto found = ransac.best_plane(candidates, labels, prior, options_.distance_sigmas,
                                         options_.hypotheses, enough, sampler);
    if (!found) return;
    if (regions_.grow(found->inliers, found->plane, enough) < 0) return;
  }
}

void PlaneExtractor::extract_floor_sections(const NormalPrior& floor) {
  const auto start = std::chrono::steady_clock::now();
  const auto spent = [start] {
    return std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start)
        .count();
  };
  for (const int section : sections_.by_priority()) {
    if (options_.time_budget_ms > 0 && spent() > options_.time_budget_ms) {
      skipped_.push_back(sections_.coordinates(section));
      continue;
    }
    // A seed of its own: what one section draws does not depend on the others.
    Sampler sampler(options_.seed * 1000003 + static_cast<std::uint64_t>(section));
    recurse(section_blocks_[static_cast<std::size_t>(section)], floor, sampler);
  }
}

// Walls, faces of steps and all beyond the region of interest: the same recursion over tiles of
// the image, with no prior.
void PlaneExtractor::extract_rest() {
  constexpr int kTile = 16;
  std::vector<int> candidates;
  for (int r0 = 0; r0 < blocks_.rows; r0 += kTile) {
    for (int c0 = 0; c0 < blocks_.columns; c0 += kTile) {
      candidates.clear();
      for (int r = r0; r < std::min(blocks_.rows, r0 + kTile); ++r) {
        for (int c = c0; c < std::min(blocks_.columns, c0 + kTile); ++c) {
          const int i = blocks_.index(c, r);
          if (blocks_.at(c, r).flat && regions_.labels()[static_cast<std::size_t>(i)] < 0) {
            candidates.push_back(i);
          }
        }
      }
      Sampler sampler(options_.seed * 7919 + static_cast<std::uint64_t>(r0 * 4096 + c0));
      recurse(candidates, NormalPrior(), sampler);
    }
  }
}

}  // namespace lamina
