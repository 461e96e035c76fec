// Values to bytes and back, by one function per type for both ways.
//
// A type is written and read by `template <class A> void fields(A& a, T& value)`, which calls
// a(member, member, ...); a class with private members has it as a friend. Integers and doubles are
// little-endian and of fixed size; containers carry their length. A reader never trusts a length
// further than the bytes that are left. Every value comes back bit for bit.
#pragma once

#include <Eigen/Core>
#include <array>
#include <bit>
#include <cstdint>
#include <cstring>
#include <deque>
#include <functional>
#include <map>
#include <optional>
#include <set>
#include <stdexcept>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <vector>

namespace lamina {

static_assert(std::endian::native == std::endian::little, "archives are little-endian");

template <class T>
inline constexpr bool kPlainValue = std::is_arithmetic_v<T> || std::is_enum_v<T>;

/// To memory, or piece by piece to where `put` takes them: what is written need not have room
/// twice.
class ArchiveWriter {
 public:
  static constexpr bool kReading = false;
  using Put = std::function<void(std::string_view)>;
  ArchiveWriter() = default;
  /// To be ended by flush().
  explicit ArchiveWriter(Put put) : put_(std::move(put)) {}
  template <class... T>
  void operator()(const T&... values) {
    (write(values), ...);
  }
  /// What `put` has not been given.
  const std::string& bytes() const { return bytes_; }
  void flush() {
    if (put_) put_(std::exchange(bytes_, {}));
  }

 private:
  template <class T>
  void write(const T& value) {
    if constexpr (std::is_same_v<T, bool>) {
      write(static_cast<std::uint8_t>(value));
    } else if constexpr (kPlainValue<T>) {
      append(&value, sizeof value);
    } else {
      fields(*this, const_cast<T&>(value));
    }
  }
  void write(const std::string& text) {
    write(static_cast<std::uint64_t>(text.size()));
    append(text.data(), text.size());
  }
  template <class T>
  void write(const std::vector<T>& values) {
    write(static_cast<std::uint64_t>(values.size()));
    if constexpr (kPlainValue<T>) {
      append(values.data(), values.size() * sizeof(T));
    } else {
      for (const T& value : values) write(value);
    }
  }
  template <class T>
  void write(const std::deque<T>& values) {
    write(static_cast<std::uint64_t>(values.size()));
    for (const T& value : values) write(value);
  }
  template <class T>
  void write(const std::set<T>& values) {
    write(static_cast<std::uint64_t>(values.size()));
    for (const T& value : values) write(value);
  }
  template <class T, std::size_t N>
  void write(const std::array<T, N>& values) {
    for (const T& value : values) write(value);
  }
  template <class T>
  void write(const std::optional<T>& value) {
    write(value.has_value());
    if (value) write(*value);
  }
  template <class K, class V>
  void write(const std::map<K, V>& values) {
    write(static_cast<std::uint64_t>(values.size()));
    for (const auto& [key, value] : values) (*this)(key, value);
  }
  template <class T, class U>
  void write(const std::pair<T, U>& value) {
    (*this)(value.first, value.second);
  }
  template <class S, int R, int C>
  void write(const Eigen::Matrix<S, R, C>& m) {
    if constexpr (R == Eigen::Dynamic || C == Eigen::Dynamic) {
      write(static_cast<std::uint64_t>(m.rows()));
      write(static_cast<std::uint64_t>(m.cols()));
    }
    append(m.data(), static_cast<std::size_t>(m.size()) * sizeof(S));
  }
  void append(const void* data, std::size_t size) {
    if (size > 0) bytes_.append(static_cast<const char*>(data), size);
    if (put_ && bytes_.size() >= kPiece) {
      put_(bytes_);
      bytes_.clear();
    }
  }
  static constexpr std::size_t kPiece = 1 << 16;  // bytes
  Put put_;
  std::string bytes_;
};

/// Throws std::out_of_range when the bytes end before the values do, or a matrix has another shape.
class ArchiveReader {
 public:
  static constexpr bool kReading = true;
  explicit ArchiveReader(std::string_view bytes) : rest_(bytes) {}
  template <class... T>
  void operator()(T&... values) {
    (read(values), ...);
  }
  bool at_end() const { return rest_.empty(); }

 private:
  template <class T>
  void read(T& value) {
    if constexpr (std::is_same_v<T, bool>) {
      std::uint8_t byte = 0;
      read(byte);
      value = byte != 0;
    } else if constexpr (kPlainValue<T>) {
      take(&value, sizeof value);
    } else {
      fields(*this, value);
    }
  }
  void read(std::string& text) {
    text.resize(length(1));
    take(text.data(), text.size());
  }
  template <class T>
  void read(std::vector<T>& values) {
    if constexpr (kPlainValue<T>) {
      values.resize(length(sizeof(T)));
      take(values.data(), values.size() * sizeof(T));
    } else {
      read_one_by_one(values);
    }
  }
  template <class T>
  void read(std::deque<T>& values) {
    read_one_by_one(values);
  }
  template <class Sequence>
  void read_one_by_one(Sequence& values) {
    const std::size_t count = length(1);
    values.clear();
    for (std::size_t i = 0; i < count; ++i) {
      values.emplace_back();
      read(values.back());
    }
  }
  template <class T>
  void read(std::set<T>& values) {
    const std::size_t count = length(1);
    values.clear();
    for (std::size_t i = 0; i < count; ++i) {
      T value{};
      read(value);
      values.insert(values.end(), std::move(value));
    }
  }
  template <class T, std::size_t N>
  void read(std::array<T, N>& values) {
    for (T& value : values) read(value);
  }
  template <class T>
  void read(std::optional<T>& value) {
    bool there = false;
    read(there);
    value.reset();
    if (there) {
      T inside{};
      read(inside);
      value = std::move(inside);
    }
  }
  template <class K, class V>
  void read(std::map<K, V>& values) {
    const std::size_t count = length(1);
    values.clear();
    for (std::size_t i = 0; i < count; ++i) {
      K key{};
      V value{};
      (*this)(key, value);
      values.emplace_hint(values.end(), std::move(key), std::move(value));
    }
  }
  template <class T, class U>
  void read(std::pair<T, U>& value) {
    (*this)(value.first, value.second);
  }
  template <class S, int R, int C>
  void read(Eigen::Matrix<S, R, C>& m) {
    if constexpr (R == Eigen::Dynamic || C == Eigen::Dynamic) {
      const std::size_t rows = length(0), cols = length(0);
      if (rows != 0 && cols > rest_.size() / sizeof(S) / rows) ended();
      const bool fits = (R == Eigen::Dynamic || rows == static_cast<std::size_t>(R)) &&
                        (C == Eigen::Dynamic || cols == static_cast<std::size_t>(C));
      if (!fits) throw std::out_of_range("a matrix has another shape");
      m.resize(static_cast<Eigen::Index>(rows), static_cast<Eigen::Index>(cols));
    }
    take(m.data(), static_cast<std::size_t>(m.size()) * sizeof(S));
  }
  // A count of items of at least `item` bytes each; bounded by what is left.
  std::size_t length(std::size_t item) {
    std::uint64_t count = 0;
    read(count);
    if (count > rest_.size() / (item == 0 ? 1 : item) + (item == 0 ? 1u << 24 : 0)) ended();
    return static_cast<std::size_t>(count);
  }
  void take(void* to, std::size_t size) {
    if (size > rest_.size()) ended();
    if (size > 0) std::memcpy(to, rest_.data(), size);
    rest_.remove_prefix(size);
  }
  [[noreturn]] static void ended() { throw std::out_of_range("the file ends early"); }
  std::string_view rest_;
};

}  // namespace lamina
