// Values to bytes and back, bit for bit; bytes that lie.
#include <lamina/models/archive.hpp>

#include <gtest/gtest.h>

#include <random>

#include <lamina/models/model_archive.hpp>

namespace lamina {
namespace {

template <class T>
T through(const T& value) {
  ArchiveWriter writer;
  writer(value);
  ArchiveReader reader(writer.bytes());
  T back{};
  reader(back);
  EXPECT_TRUE(reader.at_end());
  return back;
}

TEST(Archive, ContainersComeBack) {
  const std::map<int, std::vector<double>> map{{-3, {1.5, 2}}, {7, {}}};
  EXPECT_EQ(through(map), map);
  const std::optional<std::string> text("plane\n");
  EXPECT_EQ(through(text), text);
  EXPECT_FALSE(through(std::optional<std::string>()).has_value());
  const std::set<std::int64_t> set{4, 2, 9};
  EXPECT_EQ(through(set), set);
  const std::deque<float> deque{1.0F, -2.0F};
  EXPECT_EQ(through(deque), deque);
  const std::array<std::uint8_t, 3> array{1, 2, 3};
  EXPECT_EQ(through(array), array);
  const Eigen::MatrixXd matrix = Eigen::MatrixXd::Random(3, 5);
  EXPECT_EQ(through(matrix), matrix);
  EXPECT_EQ(through(Eigen::Vector3f(1, 2, 3)), Eigen::Vector3f(1, 2, 3));
}

TEST(Archive, PosesAndPlanesComeBackBitForBit) {
  std::mt19937_64 engine(3);
  std::normal_distribution<double> normal;
  const auto random = [&] {
    return Eigen::Vector3d(normal(engine), normal(engine), normal(engine));
  };
  SE3 pose;
  for (int i = 0; i < 500; ++i) {
    Vector6d d;
    d << random(), random();
    pose = pose * SE3::exp(d);
    const SE3 back = through(pose);
    ASSERT_EQ(back.so3().quaternion().coeffs(), pose.so3().quaternion().coeffs());
    ASSERT_EQ(back.translation(), pose.translation());
    const Plane plane = Plane(random(), normal(engine)).boxplus(0.3 * random());
    const Plane plane_back = through(plane);
    ASSERT_EQ(plane_back.normal(), plane.normal());
    ASSERT_EQ(plane_back.rho(), plane.rho());
  }
}

TEST(Archive, MomentsAndOutlinesComeBack) {
  Moments moments;
  for (int i = 0; i < 9; ++i) moments.add({0.1 * i, 0.3 * i * i, 1.0 / (1 + i)}, 2.5);
  const Moments back = through(moments);
  EXPECT_EQ(back.weight(), moments.weight());
  EXPECT_EQ(back.mean(), moments.mean());
  EXPECT_EQ(back.scatter(), moments.scatter());
  EXPECT_EQ(back.count(), moments.count());
  OutlineGrid outline(0.07);
  outline.add_stroke({-3, 1}, {2, 2.5});
  const OutlineGrid outline_back = through(outline);
  EXPECT_EQ(outline_back.cells(), outline.cells());
  EXPECT_EQ(outline_back.cell_size(), outline.cell_size());
}

TEST(Archive, LengthsBeyondTheBytesThrowBeforeTheyAllocate) {
  ArchiveWriter writer;
  writer(std::uint64_t{1} << 60);
  std::vector<double> numbers;
  std::vector<std::string> texts;
  std::map<int, int> map;
  std::string text;
  Eigen::MatrixXd matrix;
  EXPECT_THROW(ArchiveReader(writer.bytes())(numbers), std::out_of_range);
  EXPECT_THROW(ArchiveReader(writer.bytes())(texts), std::out_of_range);
  EXPECT_THROW(ArchiveReader(writer.bytes())(map), std::out_of_range);
  EXPECT_THROW(ArchiveReader(writer.bytes())(text), std::out_of_range);
  EXPECT_THROW(ArchiveReader(writer.bytes())(matrix), std::out_of_range);
}

// Found by fuzzing: a column with no columns has rows, and nothing behind them.
TEST(Archive, MatricesOfAnotherShapeThrow) {
  ArchiveWriter writer;
  writer(std::uint64_t{3}, std::uint64_t{0}, Eigen::Vector3d(1, 2, 3));
  Eigen::VectorXd column;
  EXPECT_THROW(ArchiveReader(writer.bytes())(column), std::out_of_range);
  EXPECT_EQ(through(Eigen::VectorXd(Eigen::Vector3d(1, 2, 3))), Eigen::Vector3d(1, 2, 3));
}

TEST(Archive, PiecesAreTheBytesInMemory) {
  const std::vector<std::string> texts(40, std::string(9000, 'x'));
  const std::vector<double> numbers(50000, 0.1);
  ArchiveWriter whole;
  whole(texts, numbers, true);
  std::string pieces;
  std::size_t count = 0, most = 0;
  ArchiveWriter archive([&](std::string_view piece) {
    pieces += piece;
    ++count;
    most = std::max(most, archive.bytes().size());
  });
  archive(texts);
  EXPECT_GT(count, 3U);  // before its end
  archive(numbers, true);
  archive.flush();
  EXPECT_EQ(pieces, whole.bytes());
  EXPECT_TRUE(archive.bytes().empty());
  EXPECT_LE(most, (std::size_t{1} << 16) + numbers.size() * sizeof(double));
  archive.flush();  // nothing is left to tell
  EXPECT_EQ(pieces.size(), whole.bytes().size());
}

TEST(Archive, EveryShortenedFormThrows) {
  ArchiveWriter writer;
  writer(std::map<int, std::vector<double>>{{1, {2, 3}}, {4, {5}}}, std::string("abc"));
  const std::string whole = writer.bytes();
  for (std::size_t size = 0; size < whole.size(); ++size) {
    ArchiveReader reader(std::string_view(whole).substr(0, size));
    std::map<int, std::vector<double>> map;
    std::string text;
    EXPECT_THROW(reader(map, text), std::out_of_range) << size;
  }
}

}  // namespace
}  // namespace lamina
