// The functions that Cyclone DDS asks of a type [CycloneDDS]: bytes in, the same bytes out.
#include "cyclone_type.hpp"

#include <dds/ddsi/q_radmin.h>

#include <algorithm>
#include <cstdio>
#include <cstring>
#include <vector>

namespace lamina::dds {
namespace {

struct RawData : ddsi_serdata {
  std::vector<unsigned char> bytes;  // a multiple of four long, as it is sent
  std::size_t size = 0;              // of them, those of the message
};

const RawData& raw(const ddsi_serdata* data) { return *static_cast<const RawData*>(data); }

RawData* make_data(const ddsi_sertype* type, ddsi_serdata_kind kind, std::size_t size) {
  auto* data = new RawData();
  ddsi_serdata_init(data, type, kind);
  data->size = size;
  data->bytes.assign((size + 3) / 4 * 4, 0);
  return data;
}

bool same_key(const ddsi_serdata*, const ddsi_serdata*) { return true; }

std::uint32_t size_of(const ddsi_serdata* data) {
  return static_cast<std::uint32_t>(raw(data).size);
}

// Fragments may overlap; each says which bytes of the whole it holds.
ddsi_serdata* from_fragments(const ddsi_sertype* type, ddsi_serdata_kind kind,
                             const nn_rdata* fragment, std::size_t size) {
  RawData* data = make_data(type, kind, size);
  std::size_t done = 0;
  for (; fragment != nullptr; fragment = fragment->nextfrag) {
    const std::size_t begin = fragment->min, end = std::min<std::size_t>(fragment->maxp1, size);
    if (end <= done || begin > done) continue;
    const unsigned char* payload =
        reinterpret_cast<const unsigned char*>(fragment->rmsg + 1) + NN_RDATA_PAYLOAD_OFF(fragment);
    std::memcpy(data->bytes.data() + done, payload + (done - begin), end - done);
    done = end;
  }
  return data;
}

ddsi_serdata* from_pieces(const ddsi_sertype* type, ddsi_serdata_kind kind,
                          ddsrt_msg_iovlen_t count, const ddsrt_iovec_t* pieces, std::size_t size) {
  RawData* data = make_data(type, kind, size);
  std::size_t done = 0;
  for (ddsrt_msg_iovlen_t i = 0; i < count; ++i) {
    const std::size_t part = std::min<std::size_t>(pieces[i].iov_len, size - done);
    std::memcpy(data->bytes.data() + done, pieces[i].iov_base, part);
    done += part;
  }
  return data;
}

ddsi_serdata* from_keyhash(const ddsi_sertype* type, const ddsi_keyhash*) {
  return make_data(type, SDK_KEY, 0);
}

ddsi_serdata* from_sample(const ddsi_sertype* type, ddsi_serdata_kind kind, const void*) {
  return make_data(type, kind, 0);  // samples are given and taken as bytes alone
}

void to_bytes(const ddsi_serdata* data, std::size_t offset, std::size_t size, void* out) {
  std::memcpy(out, raw(data).bytes.data() + offset, size);
}

ddsi_serdata* lend_bytes(const ddsi_serdata* data, std::size_t offset, std::size_t size,
                         ddsrt_iovec_t* piece) {
  piece->iov_base = const_cast<unsigned char*>(raw(data).bytes.data()) + offset;
  piece->iov_len = static_cast<ddsrt_iov_len_t>(size);
  return ddsi_serdata_ref(data);
}

void end_loan(ddsi_serdata* data, const ddsrt_iovec_t*) { ddsi_serdata_unref(data); }

bool to_sample(const ddsi_serdata*, void*, void**, void*) { return true; }

ddsi_serdata* to_untyped(const ddsi_serdata* data) { return make_data(data->type, SDK_KEY, 0); }

bool untyped_to_sample(const ddsi_sertype*, const ddsi_serdata*, void*, void**, void*) {
  return true;
}

void free_data(ddsi_serdata* data) { delete static_cast<RawData*>(data); }

std::size_t print(const ddsi_sertype*, const ddsi_serdata* data, char* out, std::size_t size) {
  return static_cast<std::size_t>(std::snprintf(out, size, "%zu bytes", raw(data).size));
}

void keyhash(const ddsi_serdata*, ddsi_keyhash* out, bool) { std::memset(out, 0, sizeof *out); }

ddsi_serdata_ops data_functions() {
  ddsi_serdata_ops all{};
  all.eqkey = same_key;
  all.get_size = size_of;
  all.from_ser = from_fragments;
  all.from_ser_iov = from_pieces;
  all.from_keyhash = from_keyhash;
  all.from_sample = from_sample;
  all.to_ser = to_bytes;
  all.to_ser_ref = lend_bytes;
  all.to_ser_unref = end_loan;
  all.to_sample = to_sample;
  all.to_untyped = to_untyped;
  all.untyped_to_sample = untyped_to_sample;
  all.free = free_data;
  all.print = print;
  all.get_keyhash = keyhash;
  return all;
}

void free_type(ddsi_sertype* type) {
  ddsi_sertype_fini(type);
  delete type;
}
void zero_samples(const ddsi_sertype*, void*, std::size_t) {}
void realloc_samples(void** samples, const ddsi_sertype*, void*, std::size_t, std::size_t count) {
  std::fill_n(samples, count, nullptr);
}
void free_samples(const ddsi_sertype*, void**, std::size_t, dds_free_op_t) {}
bool equal(const ddsi_sertype*, const ddsi_sertype*) { return true; }
std::uint32_t hash(const ddsi_sertype*) { return 0; }

ddsi_sertype_ops type_functions() {
  ddsi_sertype_ops all{};
  all.version = ddsi_sertype_v0;
  all.free = free_type;
  all.zero_samples = zero_samples;
  all.realloc_samples = realloc_samples;
  all.free_samples = free_samples;
  all.equal = equal;
  all.hash = hash;
  return all;
}

}  // namespace

ddsi_sertype* make_raw_type(const std::string& name) {
  static const ddsi_serdata_ops data_ops = data_functions();
  static const ddsi_sertype_ops type_ops = type_functions();
  auto* type = new ddsi_sertype{};
  ddsi_sertype_init(type, name.c_str(), &type_ops, &data_ops, true);
  return type;
}

ddsi_serdata* make_raw_data(const ddsi_sertype* type, std::string_view bytes) {
  RawData* data = make_data(type, SDK_DATA, bytes.size());
  std::memcpy(data->bytes.data(), bytes.data(), bytes.size());
  data->statusinfo = 0;
  data->timestamp.v = dds_time();
  return data;
}

std::string_view bytes_of(const ddsi_serdata* data) {
  const RawData& all = raw(data);
  return {reinterpret_cast<const char*>(all.bytes.data()), all.size};
}

}  // namespace lamina::dds
