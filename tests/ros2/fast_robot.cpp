// Fast DDS with a type of its own for bytes.
#include "ros2/fast_robot.hpp"

#include <fastdds/rtps/transport/UDPv4TransportDescriptor.h>
#include <fastdds/dds/domain/DomainParticipant.hpp>
#include <fastdds/dds/domain/DomainParticipantFactory.hpp>
#include <fastdds/dds/publisher/DataWriter.hpp>
#include <fastdds/dds/publisher/Publisher.hpp>
#include <fastdds/dds/subscriber/DataReader.hpp>
#include <fastdds/dds/subscriber/DataReaderListener.hpp>
#include <fastdds/dds/subscriber/SampleInfo.hpp>
#include <fastdds/dds/subscriber/Subscriber.hpp>
#include <fastdds/dds/topic/TypeSupport.hpp>

#include <atomic>
#include <cstring>
#include <map>
#include <stdexcept>
#include <vector>

namespace lamina::test {
namespace {

using namespace eprosima::fastdds::dds;
using eprosima::fastrtps::rtps::InstanceHandle_t;
using eprosima::fastrtps::rtps::SerializedPayload_t;

constexpr std::uint32_t kLargest = 4u << 20;  // bytes of a message

class BytesType final : public TopicDataType {
 public:
  explicit BytesType(const std::string& name) {
    setName(name.c_str());
    m_typeSize = kLargest;
    m_isGetKeyDefined = false;
    auto_fill_type_information(false);
    auto_fill_type_object(false);
  }
  bool serialize(void* data, SerializedPayload_t* payload) override {
    const auto& bytes = *static_cast<const std::string*>(data);
    if (bytes.size() > payload->max_size) return false;
    std::memcpy(payload->data, bytes.data(), bytes.size());
    payload->length = static_cast<std::uint32_t>(bytes.size());
    payload->encapsulation = CDR_LE;
    return true;
  }
  bool deserialize(SerializedPayload_t* payload, void* data) override {
    const void* begin = payload->data;
    static_cast<std::string*>(data)->assign(static_cast<const char*>(begin), payload->length);
    return true;
  }
  std::function<std::uint32_t()> getSerializedSizeProvider(void* data) override {
    return [data] { return static_cast<std::uint32_t>(static_cast<std::string*>(data)->size()); };
  }
  void* createData() override { return new std::string(); }
  void deleteData(void* data) override { delete static_cast<std::string*>(data); }
  bool getKey(void*, InstanceHandle_t*, bool) override { return false; }
};

class Listener final : public DataReaderListener {
 public:
  explicit Listener(std::function<void(const std::string&)> received)
      : received_(std::move(received)) {}
  void on_data_available(DataReader* reader) override {
    std::string bytes;
    SampleInfo info;
    while (reader->take_next_sample(&bytes, &info) == ReturnCode_t::RETCODE_OK)
      if (info.valid_data) received_(bytes);
  }

 private:
  std::function<void(const std::string&)> received_;
};

// "sensor_msgs/msg/LaserScan" is sensor_msgs::msg::dds_::LaserScan_.
std::string dds_type(const std::string& type) {
  const std::size_t a = type.find('/'), b = type.rfind('/');
  return type.substr(0, a) + "::msg::dds_::" + type.substr(b + 1) + "_";
}

template <class Policies>
void set(Policies& policies, const RobotQos& qos) {
  policies.reliability().kind =
      qos.reliable ? RELIABLE_RELIABILITY_QOS : BEST_EFFORT_RELIABILITY_QOS;
  policies.durability().kind =
      qos.transient_local ? TRANSIENT_LOCAL_DURABILITY_QOS : VOLATILE_DURABILITY_QOS;
  policies.history().kind = KEEP_LAST_HISTORY_QOS;
  policies.history().depth = qos.depth;
  policies.endpoint().history_memory_policy = eprosima::fastrtps::rtps::DYNAMIC_RESERVE_MEMORY_MODE;
}

}  // namespace

struct FastRobot::Inside {
  DomainParticipant* participant = nullptr;
  Publisher* publisher = nullptr;
  Subscriber* subscriber = nullptr;
  std::map<std::string, DataWriter*> writers;
  std::vector<std::unique_ptr<Listener>> listeners;

  Topic* topic_of(const std::string& topic, const std::string& type) const {
    TypeSupport support(new BytesType(dds_type(type)));
    support.register_type(participant);
    Topic* made =
        participant->create_topic("rt" + topic, support.get_type_name(), TOPIC_QOS_DEFAULT);
    if (made == nullptr) throw std::runtime_error("Fast DDS makes no topic " + topic);
    return made;
  }
};

// As fastdds_loopback.xml would say it: UDP on 127.0.0.1 alone.
FastRobot::FastRobot(int domain) : inside_(std::make_unique<Inside>()) {
  DomainParticipantQos qos = PARTICIPANT_QOS_DEFAULT;
  auto udp = std::make_shared<eprosima::fastdds::rtps::UDPv4TransportDescriptor>();
  udp->interfaceWhiteList.emplace_back("127.0.0.1");
  qos.transport().use_builtin_transports = false;
  qos.transport().user_transports.push_back(udp);
  eprosima::fastrtps::rtps::Locator_t local;
  eprosima::fastrtps::rtps::IPLocator::setIPv4(local, 127, 0, 0, 1);
  qos.wire_protocol().builtin.initialPeersList.push_back(local);
  inside_->participant = DomainParticipantFactory::get_instance()->create_participant(
      static_cast<std::uint32_t>(domain), qos);
  if (inside_->participant == nullptr) throw std::runtime_error("Fast DDS makes no participant");
  inside_->publisher = inside_->participant->create_publisher(PUBLISHER_QOS_DEFAULT);
  inside_->subscriber = inside_->participant->create_subscriber(SUBSCRIBER_QOS_DEFAULT);
}

FastRobot::~FastRobot() {
  inside_->participant->delete_contained_entities();
  DomainParticipantFactory::get_instance()->delete_participant(inside_->participant);
}

void FastRobot::advertise(const std::string& topic, const std::string& type, const RobotQos& qos) {
  DataWriterQos policies = DATAWRITER_QOS_DEFAULT;
  set(policies, qos);
  policies.publish_mode().kind = ASYNCHRONOUS_PUBLISH_MODE;  // images are sent in pieces
  inside_->writers[topic] =
      inside_->publisher->create_datawriter(inside_->topic_of(topic, type), policies);
  if (inside_->writers[topic] == nullptr) throw std::runtime_error("Fast DDS: no writer " + topic);
}

void FastRobot::publish(const std::string& topic, const std::string& cdr) {
  std::string bytes = cdr;
  inside_->writers.at(topic)->write(&bytes);
}

int FastRobot::subscribers(const std::string& topic) const {
  PublicationMatchedStatus status;
  inside_->writers.at(topic)->get_publication_matched_status(status);
  return status.current_count;
}

void FastRobot::subscribe(const std::string& topic, const std::string& type, const RobotQos& qos,
                          std::function<void(const std::string& cdr)> received) {
  DataReaderQos policies = DATAREADER_QOS_DEFAULT;
  set(policies, qos);
  inside_->listeners.push_back(std::make_unique<Listener>(std::move(received)));
  if (inside_->subscriber->create_datareader(inside_->topic_of(topic, type), policies,
                                             inside_->listeners.back().get()) == nullptr)
    throw std::runtime_error("Fast DDS: no reader " + topic);
}

}  // namespace lamina::test
