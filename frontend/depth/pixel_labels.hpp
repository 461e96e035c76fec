// From labels of blocks to labels of pixels: only blocks at borders are looked at again.
#pragma once

#include <array>
#include <cmath>
#include <cstdint>
#include <vector>

#include <lamina/frontend/depth/labels_about.hpp>
#include <lamina/frontend/depth/plane_regions.hpp>

namespace lamina {

/// Labels of pixels: region index + 1, 0: none. Blocks amid their own kind are filled (missing
/// pixels stay 0), but for those with outliers; in all others a pixel goes to the plane of a block
/// around (two blocks' reach) that fits it best. The planes are then refitted on their own pixels,
/// and the border is settled again until they rest: blocks that held two surfaces no longer bend
/// thin planes. Sums, planes and pixels of the regions are renewed.
class PixelLabeller {
 public:
  /// A plane (px of disparity, from the principal point), and what a residual r from it costs:
  /// weight r^2 + offset, the log of the plane's variance against that of one without slope.
  struct Cost {
    float a, b, c, weight, offset;
    float gate;  ///< px: residuals beyond are not its own

    Eigen::Vector3f plane() const { return {a, b, c}; }
  };
  /// The first `count` of each.
  struct Candidates {
    static constexpr int kMost = LabelsAbout::kMost;
    std::array<std::int16_t, kMost> label;
    std::array<std::uint8_t, kMost> bit;  ///< which one of its block's planes it is
    std::array<Cost, kMost> plane;
    int count = 0;
  };

  /// `prune`: leave out, in passes after the first, planes that can have no pixel of a block.
  /// Without it the labels are the same and take longer: the pruning's twin, for tests.
  explicit PixelLabeller(bool prune = true) : prune_(prune) {}

  /// `sigma`: of one pixel's disparity (px).
  void label(const DisparityImage& image, const DisparityGeometry& g, const BlockImage& blocks,
             float sigma, PlaneRegions& regions, std::vector<std::uint8_t>& pixel_labels);
  /// Of every block: the region that holds at least half of its pixels, -1: none.
  const std::vector<std::int16_t>& majority() const { return majority_; }
  /// Of the last labelling: passes over the border, and planes looked at in its blocks.
  int passes() const { return passes_; }
  int looks() const { return looks_; }
  /// Gives the regions of the last labelling new indices (-1: its pixels belong to none).
  void rename(std::span<const std::int16_t> renamed);

 private:
  struct Window {
    int u0 = 0, v0 = 0, width = 0, height = 0;
    std::size_t offset = 0;      ///< of its first pixel
    float mid_u = 0, mid_v = 0;  ///< its middle, from the principal point
  };
  struct Marks {
    const std::uint8_t* first;  ///< of a window
    int stride;
  };
  struct Border {
    int block = 0;
    int least = -1;  ///< its place in least_, -1: none yet
    Window window;
    LabelsAbout::Found near;
    std::array<std::uint16_t, Candidates::kMost> pixels{};  ///< labelled with near.label[k]
    std::uint8_t present = 0;  ///< bit k: pixels are labelled with near.label[k]
  };
  /// How near the pixels of a block came to its planes (px) when these were those of a pass.
  struct Least {
    std::array<float, Candidates::kMost> px;
    int pass;
  };
  struct Spread {
    float middle, reach;
  };
  Window window(int block) const;
  void fill(int block, std::uint8_t mark);
  bool is_untouched(int block) const;
  void fill_inner(const PlaneRegions& regions);
  void take_planes(const PlaneRegions& regions, float sigmas);
  bool label_border(const PlaneRegions& regions, float sigmas, int pass, float band);
  Border border_of(int block) const;
  unsigned planes_within_reach(const Border& border, float band) const;
  /// A difference of two planes in a window (px): in its middle, and by how much it may be more or
  /// less elsewhere.
  Spread spread_of(const Window& w, const Eigen::Vector3f& difference) const {
    return {difference.dot(Eigen::Vector3f(w.mid_u, w.mid_v, 1)),
            0.5F * static_cast<float>(blocks_->size) *
                (std::abs(difference.x()) + std::abs(difference.y()))};
  }
  Candidates candidates_of(const Border& border, unsigned wanted) const;
  void label_pixels(Border& border, const Candidates& near, float sigmas, bool measure);
  void settle_creases(const PlaneRegions& regions, const Border& border, const Candidates& near,
                      float band);
  float side_of(const PlaneRegions& regions, int block, int first, int second,
                const Eigen::Vector3f& difference, float band) const;
  void keep_marks(const Window& w);
  void note_holders(Border& border);
  using Counts = std::array<int, Candidates::kMost>;
  Counts count(Border& border, const Marks& marks, const Candidates& near);
  void account(Border& border, const Marks& marks, const Candidates& near, int sign);
  void account_changes(Border& border, const Candidates& near);
  DisparitySums sums_of(const Window& w, const Marks& marks, std::uint8_t mark,
                        const Eigen::Vector3f& plane) const;
  void refit(PlaneRegions& regions, double least, bool ahead);

  bool prune_;
  int passes_ = 0, looks_ = 0;
  const DisparityImage* image_ = nullptr;
  const DisparityGeometry* geometry_ = nullptr;
  const BlockImage* blocks_ = nullptr;
  std::vector<std::uint8_t>* out_ = nullptr;
  std::vector<DisparitySums> sums_;
  LabelsAbout about_;
  std::vector<Border> border_;
  std::vector<std::int16_t> majority_, inner_, across_;
  std::vector<Cost> costs_;              ///< of the regions
  std::vector<Eigen::Vector3f> planes_;  ///< theirs in every pass
  std::vector<Least> least_;
  std::vector<DisparityPlane> steps_;  ///< of the regions, at the last refit
  std::vector<std::uint8_t> moved_;
  std::vector<std::uint8_t> old_marks_;  ///< of the window at hand, row by row
  float variance_ = 1;                   ///< px^2, of one pixel on a plane without slope
};

}  // namespace lamina
