// The page over HTTP, with cpp-httplib.
#include <httplib.h>

#include <algorithm>
#include <charconv>
#include <chrono>
#include <condition_variable>
#include <functional>
#include <mutex>
#include <thread>

#include <lamina/models/error.hpp>
#include <lamina/viewer/live_server.hpp>
#include <lamina/viewer/report.hpp>

namespace lamina::viewer {
namespace {

using Clock = std::chrono::steady_clock;
using Text = std::shared_ptr<const std::string>;

bool loopback(const std::string& address) {
  return address == "localhost" || address == "::1" || address.rfind("127.", 0) == 0;
}

/// "127.0.0.1:8765" and "[::1]:8765" without the port.
std::string host_of(const std::string& header) {
  if (!header.empty() && header[0] == '[') return header.substr(1, header.find(']') - 1);
  return header.substr(0, header.find(':'));
}

/// By a provider: the library would compress a body itself, at the slowest level it has.
/// `sent`: called once the whole of it was written to the connection.
void answer(httplib::Response& response, Text text, const char* type,
            std::function<void()> sent = {}) {
  const std::size_t size = text->size();
  response.set_content_provider(
      size, type,
      [text = std::move(text)](std::size_t offset, std::size_t length, httplib::DataSink& sink) {
        sink.write(text->data() + offset, std::min<std::size_t>(length, 1U << 16U));
        return true;
      },
      [sent = std::move(sent)](bool whole) {
        if (whole && sent) sent();
      });
}

std::uint64_t number_of(const std::string& text) {
  std::uint64_t value = 0;
  std::from_chars(text.data(), text.data() + text.size(), value);
  return value;
}

}  // namespace

LiveAddress LiveAddress::parse(const std::string& text) {
  LiveAddress where;
  if (text.empty()) return where;
  const auto fault = [&] {
    return Error("--live: found '" + text + "', expected [ADDRESS:]PORT, as 8080 or 0.0.0.0:8080");
  };
  std::string port = text;
  if (const auto colon = text.rfind(':'); colon != std::string::npos) {
    port = text.substr(colon + 1);
    std::string address = text.substr(0, colon);
    if (address.size() > 2 && address.front() == '[' && address.back() == ']') {
      address = address.substr(1, address.size() - 2);
    } else if (address.find(':') != std::string::npos) {
      throw fault();
    }
    if (!address.empty()) where.address = address;
  }
  const auto [end, error] = std::from_chars(port.data(), port.data() + port.size(), where.port);
  if (error != std::errc() || end != port.data() + port.size() || where.port < 0 ||
      where.port > 65535) {
    throw fault();
  }
  where.port_named = true;
  return where;
}

struct LiveServer::State {
  LiveAddress where;
  httplib::Server server;
  std::thread thread;
  mutable std::mutex mutex;
  std::condition_variable fetched;
  Text data = std::make_shared<const std::string>("{}");
  std::uint64_t version = 0, fetched_version = 0;
  Clock::time_point asked = Clock::now() - std::chrono::hours(1);

  void bind();
  void serve();
  void give_page(httplib::Response& response);
  void give_data(const httplib::Request& request, httplib::Response& response);
};

void LiveServer::State::bind() {
  // The library's own options let two programs share a port.
  server.set_socket_options([](auto socket) {
    const int yes = 1;
    ::setsockopt(socket, SOL_SOCKET, SO_REUSEADDR, &yes, sizeof yes);
  });
  bool bound = where.port != 0 && server.bind_to_port(where.address, where.port);
  if (!bound && (where.port == 0 || !where.port_named)) {
    where.port = server.bind_to_any_port(where.address);
    bound = where.port > 0;
  }
  if (!bound) {
    throw Error("--live: found no way to listen at " + where.address + ", port " +
                std::to_string(where.port) + ", expected a free port of this machine's address");
  }
}

void LiveServer::State::serve() {
  server.set_keep_alive_timeout(2);
  server.set_keep_alive_max_count(1000);
  server.set_default_headers({{"Cache-Control", "no-store"},
                              {"X-Content-Type-Options", "nosniff"},
                              {"Cross-Origin-Resource-Policy", "same-origin"}});
  server.set_pre_routing_handler([this](const httplib::Request& request, httplib::Response& out) {
    const std::string host = host_of(request.get_header_value("Host"));
    if (!loopback(where.address) || loopback(host)) {
      return httplib::Server::HandlerResponse::Unhandled;
    }
    out.status = 403;
    return httplib::Server::HandlerResponse::Handled;
  });
  server.Get("/", [this](const httplib::Request&, httplib::Response& out) { give_page(out); });
  server.Get("/data", [this](const httplib::Request& request, httplib::Response& out) {
    give_data(request, out);
  });
  thread = std::thread([this] { server.listen_after_bind(); });
  while (!server.is_running()) std::this_thread::sleep_for(std::chrono::milliseconds(1));
}

void LiveServer::State::give_page(httplib::Response& response) {
  const std::lock_guard lock(mutex);
  asked = Clock::now();
  // The page fetches the data itself: they are not sent twice.
  answer(response, std::make_shared<const std::string>(live_page()), "text/html; charset=utf-8");
}

void LiveServer::State::give_data(const httplib::Request& request, httplib::Response& response) {
  const std::lock_guard lock(mutex);
  asked = Clock::now();
  if (version == 0 || number_of(request.get_param_value("after")) == version) {
    response.status = 204;
    return;
  }
  response.set_header("X-Version", std::to_string(version));
  answer(response, data, "application/json", [this, given = version] {
    const std::lock_guard later(mutex);
    fetched_version = std::max(fetched_version, given);
    fetched.notify_all();
  });
}

LiveServer::LiveServer(const LiveAddress& where) : state_(std::make_unique<State>()) {
  state_->where = where;
  state_->bind();
  state_->serve();
}

LiveServer::~LiveServer() {
  state_->server.stop();
  state_->thread.join();
}

std::string LiveServer::url() const {
  const LiveAddress& where = state_->where;
  const bool v6 = where.address.find(':') != std::string::npos;
  return "http://" + (v6 ? "[" + where.address + "]" : where.address) + ":" +
         std::to_string(where.port) + "/";
}

void LiveServer::publish(std::string data) {
  auto text = std::make_shared<const std::string>(std::move(data));
  const std::lock_guard lock(state_->mutex);
  state_->data = std::move(text);
  ++state_->version;
}

bool LiveServer::wanted(double seconds) const {
  const std::lock_guard lock(state_->mutex);
  return std::chrono::duration<double>(Clock::now() - state_->asked).count() < seconds;
}

void LiveServer::wait_until_fetched(double seconds) {
  std::unique_lock lock(state_->mutex);
  state_->fetched.wait_for(lock, std::chrono::duration<double>(seconds),
                           [this] { return state_->fetched_version == state_->version; });
}

}  // namespace lamina::viewer
