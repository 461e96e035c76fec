// Journal and state.
#include <lamina/pipeline/checkpoint.hpp>

#include <fcntl.h>
#include <unistd.h>

#include <fstream>
#include <sstream>

#include <lamina/io/atomic_file.hpp>
#include <lamina/io/sealed_file.hpp>
#include <lamina/models/error.hpp>
#include <lamina/pipeline/step_archive.hpp>

namespace lamina {
namespace {

constexpr io::SealedKind kKind{"LAMINACP", 31, "a checkpoint of `lamina map`"};

constexpr std::size_t kMostPending = 4 << 20;  // bytes

struct Header {
  std::string identity;
  std::int64_t measurements = 0;
  std::uint64_t journal_bytes = 0, journal_sum = 0;
};
template <class A>
void fields(A& a, Header& v) {
  a(v.identity, v.measurements, v.journal_bytes, v.journal_sum);
}

std::string first_bytes(const std::filesystem::path& file, std::uint64_t count) {
  std::error_code error;
  const auto there = std::filesystem::file_size(file, error);
  if (error || there < count) return {};
  std::string bytes(count, '\0');
  std::ifstream in(file, std::ios::binary);
  in.read(bytes.data(), static_cast<std::streamsize>(count));
  return in ? bytes : std::string();
}

// The first line in which two texts differ, with the key of its section before it.
std::string difference(const std::string& found, const std::string& wanted) {
  std::istringstream a(found), b(wanted);
  std::string line_a, line_b, section;
  while (std::getline(a, line_a)) {
    const bool more = static_cast<bool>(std::getline(b, line_b));
    if (more && line_a == line_b) {
      if (!line_a.empty() && line_a.back() == ':') section = line_a.substr(0, line_a.size() - 1);
      continue;
    }
    const auto first = line_a.find_first_not_of(' ');
    const std::string name =
        (first == 0 || first == std::string::npos ? "" : section + ".") + line_a.substr(first);
    const auto value = more ? line_b.find(": ") : std::string::npos;
    return name + " there, " + (value == std::string::npos ? "none" : line_b.substr(value + 2)) +
           " here";
  }
  return "less";
}

// From an open checkpoint on, the archive stands behind the header.
Header header_of(ArchiveReader& archive, const std::filesystem::path& folder,
                 const std::string& identity) {
  Header header;
  archive(header);
  if (header.identity == identity) return header;
  throw Error(folder.string() + ": found a checkpoint of another run (" +
              difference(header.identity, identity) +
              "), expected the same input, mode and settings; without --resume it starts anew");
}

}  // namespace

template <class A>
void fields(A& a, ClosedStep& v) {
  a(v.step, v.loops);
}

Checkpoint::Checkpoint(const std::filesystem::path& output, std::string identity, double interval_s)
    : folder_(output / ".checkpoint"), identity_(std::move(identity)), interval_s_(interval_s) {}

Checkpoint::~Checkpoint() {
  if (journal_ >= 0) ::close(journal_);
}

void Checkpoint::begin() {
  remove(folder_.parent_path());
  io::make_output_folder(folder_);
  journal_sum_ = io::checksum({});
}

void Checkpoint::require_same_run() const {
  const auto file = folder_ / "state";
  if (!std::filesystem::exists(file)) return;
  const std::string content = io::read_sealed(file, kKind);
  try {
    ArchiveReader archive(content);
    header_of(archive, folder_, identity_);
  } catch (const std::out_of_range&) {  // resume() comes to it, and says so
  }
}

std::int64_t Checkpoint::resume(FrontEnd& front_end, LoopCloser& closer,
                                const std::function<void(ClosedStep&&)>& take) {
  const auto file = folder_ / "state";
  if (!std::filesystem::exists(file)) {
    begin();
    return 0;
  }
  const std::string content = io::read_sealed(file, kKind);
  try {
    ArchiveReader archive(content);
    const Header header = header_of(archive, folder_, identity_);
    archive(front_end, closer);
    const std::string journal = first_bytes(folder_ / "journal", header.journal_bytes);
    if (journal.size() != header.journal_bytes || io::checksum(journal) != header.journal_sum) {
      throw Error((folder_ / "journal").string() +
                  ": found damaged content, expected the journal of a checkpoint");
    }
    ArchiveReader entries(journal);
    while (!entries.at_end()) {
      ClosedStep entry;
      entries(entry);
      take(std::move(entry));
    }
    measurements_ = header.measurements;
    journal_bytes_ = header.journal_bytes;
    journal_sum_ = header.journal_sum;
  } catch (const std::out_of_range& error) {
    throw Error(file.string() + ": found content that makes no sense (" + error.what() +
                "), expected " + std::string(kKind.name));
  }
  // What a killed run wrote after its last state is not part of it.
  std::filesystem::resize_file(folder_ / "journal", journal_bytes_);
  return measurements_;
}

void Checkpoint::add(const Step& step, const std::vector<LoopClosure>& loops) {
  ArchiveWriter archive;
  archive(step, loops);
  pending_ += archive.bytes();
  // A recording that is read fast fills an interval with many steps.
  if (pending_.size() > kMostPending) append_journal();
}

bool Checkpoint::due() const {
  return std::chrono::duration<double>(Clock::now() - last_).count() >= interval_s_;
}

void Checkpoint::append_journal() {
  const auto file = folder_ / "journal";
  if (journal_ < 0)
    journal_ = ::open(file.c_str(), O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC, 0644);
  std::size_t done = 0;
  while (journal_ >= 0 && done < pending_.size()) {
    const auto wrote = ::write(journal_, pending_.data() + done, pending_.size() - done);
    if (wrote <= 0) break;
    done += static_cast<std::size_t>(wrote);
  }
  if (journal_ < 0 || done < pending_.size()) {
    throw Error(file.string() + ": writing failed, is the disk full?");
  }
  journal_bytes_ += pending_.size();
  journal_sum_ = io::checksum(pending_, journal_sum_);
  pending_.clear();
}

void Checkpoint::save(const FrontEnd& front_end, const LoopCloser& closer) {
  append_journal();
  ::fsync(journal_);
  io::write_sealed(folder_ / "state", kKind, [&](const ArchiveWriter::Put& put) {
    ArchiveWriter archive(put);
    archive(Header{identity_, measurements_, journal_bytes_, journal_sum_}, front_end, closer);
    archive.flush();
  });
  last_ = Clock::now();
  ++saves_;
}

void Checkpoint::remove(const std::filesystem::path& output) {
  const std::filesystem::path folder = output / ".checkpoint";
  // The state goes first: a journal without one is nothing.
  std::error_code ignored;
  std::filesystem::remove(folder / "state", ignored);
  std::filesystem::remove_all(folder, ignored);
}

}  // namespace lamina
