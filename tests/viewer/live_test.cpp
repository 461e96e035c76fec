// The live page's address, its server, and the data of a map under way.
#include <gmock/gmock.h>
#include <httplib.h>

#include <chrono>
#include <future>
#include <memory>
#include <nlohmann/json.hpp>
#include <thread>
#include <utility>

#include <lamina/models/error.hpp>
#include <lamina/viewer/live_data.hpp>
#include <lamina/viewer/live_server.hpp>

namespace lamina::viewer {
namespace {

using testing::HasSubstr;

LiveAddress any_port() { return LiveAddress::parse("0"); }

httplib::Client client_of(const LiveServer& server) {
  const std::string url = server.url();
  return httplib::Client(url.substr(0, url.size() - 1));
}

TEST(LiveAddress, LoopbackUnlessTold) {
  EXPECT_EQ(LiveAddress::parse("").address, "127.0.0.1");
  EXPECT_FALSE(LiveAddress::parse("").port_named);
  EXPECT_EQ(LiveAddress::parse("9000").address, "127.0.0.1");
  EXPECT_EQ(LiveAddress::parse("9000").port, 9000);
  EXPECT_EQ(LiveAddress::parse(":9000").address, "127.0.0.1");
  EXPECT_EQ(LiveAddress::parse("0.0.0.0:80").address, "0.0.0.0");
  EXPECT_EQ(LiveAddress::parse("[::1]:80").address, "::1");
  for (const char* wrong : {"nine", "70000", "-1", "80a", "localhost", "::1:80", "127.0.0.1:"}) {
    EXPECT_THROW(LiveAddress::parse(wrong), Error) << wrong;
  }
}

TEST(LiveServer, GivesWhatIsNew) {
  LiveServer server(any_port());
  EXPECT_THAT(server.url(), HasSubstr("http://127.0.0.1:"));
  EXPECT_FALSE(server.wanted(5));
  auto client = client_of(server);
  const auto nothing = client.Get("/data?after=0");
  ASSERT_TRUE(nothing);
  EXPECT_EQ(nothing->status, 204);
  EXPECT_TRUE(server.wanted(5));
  const std::string large(3'000'000, '7');
  server.publish(large);
  const auto first = client.Get("/data?after=0");
  ASSERT_TRUE(first);
  EXPECT_EQ(first->body, large);
  EXPECT_EQ(first->get_header_value("X-Version"), "1");
  EXPECT_EQ(client.Get("/data?after=1")->status, 204);
  server.publish("{\"a\":2}");
  EXPECT_EQ(client.Get("/data?after=1")->body, "{\"a\":2}");
  server.wait_until_fetched(10);  // fetched: returns at once
}

TEST(LiveServer, EndsAfterTheLastPictureHasArrived) {
  const std::string large(16'000'000, '7');  // more than the buffers of a connection hold
  auto server = std::make_unique<LiveServer>(any_port());
  server->publish(large);
  auto client = client_of(*server);
  std::size_t arrived = 0;
  std::promise<void> begun;
  std::thread reader([&] {
    bool first = true;
    const auto slowly = [&](const char*, std::size_t length) {
      if (std::exchange(first, false)) {
        begun.set_value();
        std::this_thread::sleep_for(std::chrono::milliseconds(30));
      }
      arrived += length;
      return true;
    };
    client.Get("/data?after=0", slowly);
  });
  begun.get_future().wait();
  server->wait_until_fetched(10);
  server.reset();
  reader.join();
  EXPECT_EQ(arrived, large.size());
}

TEST(LiveServer, PageAsksItsServerAlone) {
  LiveServer server(any_port());
  const auto page = client_of(server).Get("/");
  ASSERT_TRUE(page);
  EXPECT_THAT(page->body, HasSubstr("default-src 'none'; connect-src 'self'; script-src"));
  EXPECT_THAT(page->body, HasSubstr("{\"live\":{\"doing\":\"waiting\"}"));
}

TEST(LiveServer, RefusesOtherNames) {
  LiveServer server(any_port());
  auto client = client_of(server);
  EXPECT_EQ(client.Get("/data", {{"Host", "elsewhere.example"}})->status, 403);
  EXPECT_EQ(client.Get("/nothing")->status, 404);
}

TEST(LiveServer, TakenPortIsAnErrorWhenNamed) {
  LiveServer server(any_port());
  LiveAddress same = any_port();
  same.port = std::stoi(server.url().substr(server.url().rfind(':') + 1));
  EXPECT_THROW(LiveServer{same}, Error);
  same.port_named = false;
  EXPECT_NE(LiveServer(same).url(), server.url());
}

TEST(LiveData, HoldsTheMapSoFar) {
  LivePicture picture;
  picture.name = "a \"name\"";
  picture.doing = "mapping";
  picture.done = 3;
  picture.map.trajectory.add(Timestamp::from_seconds(10), SE3());
  picture.map.trajectory.add(Timestamp::from_seconds(11), SE3(SO3(), {1, 0, 0}));
  picture.map.planes.push_back({});
  picture.map.surfels.push_back({});
  picture.keyframes = {SE3()};
  picture.points_map = {{1, 2, 3}};
  const auto data = nlohmann::json::parse(live_data(picture));
  EXPECT_EQ(data.at("name"), picture.name);
  EXPECT_EQ(data.at("live").at("doing"), "mapping");
  EXPECT_EQ(data.at("start"), 10.0);
  EXPECT_EQ(data.at("trajectory").at("count"), 2);
  for (const char* list : {"keyframes", "points", "surfels"}) {
    EXPECT_EQ(data.at(list).at("count"), 1) << list;
  }
  EXPECT_EQ(data.at("planes").size(), 1U);
  const auto last = nlohmann::json::parse(finished_data("{\"planes\":[]}", "out", 5));
  EXPECT_EQ(last.at("live").at("doing"), "finished");
  EXPECT_TRUE(last.at("planes").empty());
}

}  // namespace
}  // namespace lamina::viewer
