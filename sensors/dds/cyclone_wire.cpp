// Wire by Cyclone DDS: the plug-in's source.
#include <lamina/sensors/dds/wire.hpp>

#include <dds/dds.h>

#include <array>
#include <cstdlib>
#include <map>
#include <mutex>
#include <utility>

#include "cyclone_type.hpp"

namespace lamina::dds {
namespace {

// What a machine sends to itself and nothing else. Participants are looked for at the ports that
// the first ones of a machine have.
constexpr const char* kLoopback =
    "<CycloneDDS><Domain><General><Interfaces><NetworkInterface name=\"lo\" multicast=\"false\"/>"
    "</Interfaces><AllowMulticast>false</AllowMulticast></General><Discovery>"
    "<ParticipantIndex>auto</ParticipantIndex><MaxAutoParticipantIndex>32"
    "</MaxAutoParticipantIndex><Peers><Peer address=\"127.0.0.1\"/></Peers></Discovery>"
    "</Domain></CycloneDDS>";

// [ROS2Names]: topics begin with rt, types are called dds_::NAME_.
std::string dds_type(const std::string& type) {
  const std::size_t a = type.find('/'), b = type.rfind('/');
  if (a == std::string::npos || a == b) return type;
  return type.substr(0, a) + "::" + type.substr(a + 1, b - a - 1) +
         "::dds_::" + type.substr(b + 1) + "_";
}

std::string ros_type(const std::string& type) {
  const std::string between = "::dds_::";
  const std::size_t at = type.find(between), first = type.find("::");
  if (at == std::string::npos || type.empty() || type.back() != '_' || first >= at) return {};
  const std::size_t name = at + between.size();
  return type.substr(0, first) + "/" + type.substr(first + 2, at - first - 2) + "/" +
         type.substr(name, type.size() - name - 1);
}

struct QosDeleter {
  void operator()(dds_qos_t* qos) const { dds_delete_qos(qos); }
};
using OwnedQos = std::unique_ptr<dds_qos_t, QosDeleter>;

OwnedQos make_qos(const Qos& stated) {
  OwnedQos qos(dds_create_qos());
  dds_qset_reliability(qos.get(),
                       stated.reliable ? DDS_RELIABILITY_RELIABLE : DDS_RELIABILITY_BEST_EFFORT,
                       DDS_MSECS(100));
  dds_qset_durability(
      qos.get(), stated.transient_local ? DDS_DURABILITY_TRANSIENT_LOCAL : DDS_DURABILITY_VOLATILE);
  dds_qset_history(qos.get(), DDS_HISTORY_KEEP_LAST, stated.depth);
  if (stated.transient_local)
    dds_qset_durability_service(qos.get(), 0, DDS_HISTORY_KEEP_LAST, stated.depth,
                                DDS_LENGTH_UNLIMITED, DDS_LENGTH_UNLIMITED, DDS_LENGTH_UNLIMITED);
  const dds_data_representation_id_t first_version = DDS_DATA_REPRESENTATION_XCDR1;
  dds_qset_data_representation(qos.get(), 1, &first_version);
  dds_qset_ignorelocal(qos.get(), DDS_IGNORELOCAL_PARTICIPANT);
  return qos;
}

// One of our configuration for all participants of the program; without it, the user's.
class Domain {
 public:
  static std::shared_ptr<Domain> of(int number) {
    static std::mutex mutex;
    static std::map<int, std::weak_ptr<Domain>> all;
    const std::lock_guard lock(mutex);
    std::shared_ptr<Domain> domain = all[number].lock();
    if (!domain) all[number] = domain = std::make_shared<Domain>(number);
    return domain;
  }
  explicit Domain(int number) {
    const char* stated = std::getenv("CYCLONEDDS_URI");
    if (stated == nullptr || *stated == '\0')
      entity_ = dds_create_domain(static_cast<dds_domainid_t>(number), kLoopback);
  }
  ~Domain() {
    if (entity_ > 0) dds_delete(entity_);
  }
  Domain(const Domain&) = delete;
  Domain& operator=(const Domain&) = delete;

 private:
  dds_entity_t entity_ = 0;
};

class CycloneWire final : public Wire {
 public:
  explicit CycloneWire(int domain) : domain_(Domain::of(domain)) {
    participant_ = dds_create_participant(static_cast<dds_domainid_t>(domain), nullptr, nullptr);
    if (participant_ < 0) return;
    dds_get_guid(participant_, &guid_);
    publications_ =
        dds_create_reader(participant_, DDS_BUILTIN_TOPIC_DCPSPUBLICATION, nullptr, nullptr);
  }
  ~CycloneWire() override {
    if (participant_ > 0) dds_delete(participant_);
  }
  std::string problem() const {
    return participant_ > 0 && publications_ > 0
               ? std::string()
               : dds_strretcode(participant_ > 0 ? publications_ : participant_);
  }

  std::vector<OfferedTopic> topics() override;
  bool subscribe(const OfferedTopic& topic, Received received) override;
  void unsubscribe(const std::string& topic) override {
    const auto found = readers_.find(topic);
    if (found == readers_.end()) return;
    dds_delete(found->second->entity);
    readers_.erase(found);
  }
  int publishers(const std::string& topic) override {
    const auto found = readers_.find(topic);
    dds_subscription_matched_status_t status{};
    if (found != readers_.end())
      dds_get_subscription_matched_status(found->second->entity, &status);
    return static_cast<int>(status.current_count);
  }
  std::int64_t lost(const std::string& topic) override {
    const auto found = readers_.find(topic);
    dds_sample_lost_status_t status{};
    if (found != readers_.end()) dds_get_sample_lost_status(found->second->entity, &status);
    return status.total_count;
  }
  bool advertise(const std::string& topic, const std::string& type, const Qos& qos) override;
  bool write(const std::string& topic, std::string_view cdr) override {
    const auto found = writers_.find(topic);
    return found != writers_.end() &&
           dds_writecdr(found->second.entity, make_raw_data(found->second.type, cdr)) == 0;
  }
  void flush(double seconds) override {
    const auto until = dds_time() + static_cast<dds_duration_t>(1e9 * seconds);
    for (const auto& [topic, writer] : writers_)
      dds_wait_for_acks(writer.entity, std::max<dds_duration_t>(0, until - dds_time()));
  }

 private:
  struct Reader {
    dds_entity_t entity = 0;
    Received received;
  };
  struct Writer {
    dds_entity_t entity = 0;
    ddsi_sertype* type = nullptr;  // the topic's
  };
  // The topic, and its type as long as the topic lives.
  dds_entity_t topic_of(const std::string& name, const std::string& type, ddsi_sertype** raw) {
    *raw = make_raw_type(dds_type(type));
    const std::string dds_name = "rt" + name;
    const dds_entity_t topic =
        dds_create_topic_sertype(participant_, dds_name.c_str(), raw, nullptr, nullptr, nullptr);
    if (topic < 0) ddsi_sertype_unref(*raw);
    return topic;
  }
  static void on_data(dds_entity_t reader, void* argument);

  std::shared_ptr<Domain> domain_;
  dds_entity_t participant_ = 0, publications_ = 0;
  dds_guid_t guid_{};
  std::map<std::string, std::unique_ptr<Reader>> readers_;
  std::map<std::string, Writer> writers_;
};

void CycloneWire::on_data(dds_entity_t reader, void* argument) {
  const auto* self = static_cast<const Reader*>(argument);
  std::array<ddsi_serdata*, 16> data{};
  std::array<dds_sample_info_t, data.size()> info{};
  while (true) {
    data.fill(nullptr);
    const dds_return_t count =
        dds_takecdr(reader, data.data(), data.size(), info.data(), DDS_ANY_STATE);
    if (count <= 0) return;
    for (std::size_t i = 0; i < static_cast<std::size_t>(count); ++i) {
      if (info[i].valid_data) self->received(bytes_of(data[i]));
      ddsi_serdata_unref(data[i]);
    }
  }
}

std::vector<OfferedTopic> CycloneWire::topics() {
  std::vector<void*> samples(1024, nullptr);  // a large robot has some hundred
  std::vector<dds_sample_info_t> info(samples.size());
  const dds_return_t count = dds_read(publications_, samples.data(), info.data(), samples.size(),
                                      static_cast<std::uint32_t>(samples.size()));
  std::map<std::string, OfferedTopic> all;
  for (dds_return_t i = 0; i < count; ++i) {
    const auto n = static_cast<std::size_t>(i);
    const auto* found = static_cast<const dds_builtintopic_endpoint_t*>(samples[n]);
    const std::string name = found->topic_name, type = ros_type(found->type_name);
    const bool own = std::equal(guid_.v, guid_.v + 16, found->participant_key.v);
    const bool there = info[n].valid_data && info[n].instance_state == DDS_IST_ALIVE;
    if (!there || own || type.empty() || name.rfind("rt/", 0) != 0) continue;
    dds_reliability_kind_t reliability = DDS_RELIABILITY_BEST_EFFORT;
    dds_durability_kind_t durability = DDS_DURABILITY_VOLATILE;
    dds_qget_reliability(found->qos, &reliability, nullptr);
    dds_qget_durability(found->qos, &durability);
    const bool reliable = reliability == DDS_RELIABILITY_RELIABLE;
    const bool kept = durability != DDS_DURABILITY_VOLATILE;
    const auto [place, first] =
        all.try_emplace(name.substr(2), OfferedTopic{name.substr(2), type, {reliable, kept, 1}, 0});
    place->second.qos.reliable = place->second.qos.reliable && reliable;
    place->second.qos.transient_local = place->second.qos.transient_local && kept;
    ++place->second.publishers;
  }
  if (count > 0) dds_return_loan(publications_, samples.data(), count);
  std::vector<OfferedTopic> list;
  for (auto& [name, topic] : all) list.push_back(std::move(topic));
  return list;
}

bool CycloneWire::subscribe(const OfferedTopic& topic, Received received) {
  ddsi_sertype* type = nullptr;
  const dds_entity_t entity = topic_of(topic.name, topic.type, &type);
  if (entity < 0) return false;
  auto reader = std::make_unique<Reader>();
  reader->received = std::move(received);
  dds_listener_t* listener = dds_create_listener(reader.get());
  dds_lset_data_available(listener, on_data);
  reader->entity = dds_create_reader(participant_, entity, make_qos(topic.qos).get(), listener);
  dds_delete_listener(listener);
  dds_delete(entity);  // the reader keeps it
  if (reader->entity < 0) return false;
  readers_[topic.name] = std::move(reader);
  return true;
}

bool CycloneWire::advertise(const std::string& topic, const std::string& type, const Qos& qos) {
  Writer writer;
  const dds_entity_t entity = topic_of(topic, type, &writer.type);
  if (entity < 0) return false;
  writer.entity = dds_create_writer(participant_, entity, make_qos(qos).get(), nullptr);
  dds_delete(entity);
  if (writer.entity < 0) return false;
  writers_[topic] = writer;
  return true;
}

}  // namespace
}  // namespace lamina::dds

extern "C" __attribute__((visibility("default"))) lamina::dds::Wire* lamina_make_wire(
    int domain, std::string* error) {
  auto wire = std::make_unique<lamina::dds::CycloneWire>(domain);
  *error = wire->problem();
  return error->empty() ? wire.release() : nullptr;
}
