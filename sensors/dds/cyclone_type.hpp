// A type of Cyclone DDS whose samples are bytes as they are sent: of any ROS 2 message.
#pragma once

#include <dds/dds.h>
#include <dds/ddsi/ddsi_serdata.h>
#include <dds/ddsi/ddsi_sertype.h>

#include <string>
#include <string_view>

namespace lamina::dds {

/// Without keys and without type information: publishers and subscribers match by its name alone.
/// The caller's reference goes to dds_create_topic_sertype().
ddsi_sertype* make_raw_type(const std::string& name);

/// Bytes with their encapsulation, to be written by dds_writecdr(), which takes the reference.
ddsi_serdata* make_raw_data(const ddsi_sertype* type, std::string_view bytes);

/// Of data that dds_takecdr() gave of a topic of such a type.
std::string_view bytes_of(const ddsi_serdata* data);

}  // namespace lamina::dds
