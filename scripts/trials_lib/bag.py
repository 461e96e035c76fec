"""Writes ROS 1 bags of version 2.0: one uncompressed chunk, indexed [rosbag format]."""
import struct

SUMS = {  # ROS checks these before it reads a message
    "sensor_msgs/LaserScan": "90c7ef2dc6895d81024acba2ac42f369",
    "nav_msgs/Odometry": "cd5e73d190d741a2f92e81eda573aca7",
    "tf2_msgs/TFMessage": "94810edda583a504dfda3829e70d7eec",
    "sensor_msgs/Image": "060021388200f6f0f447d0fcd9c64743",
    "sensor_msgs/CameraInfo": "c9a58c1b0b154e0e6da7578cb991d214",
}


def _time(ns):
    return struct.pack("<II", ns // 10**9, ns % 10**9)


def _text(text):
    return struct.pack("<I", len(text)) + text.encode()


def _header(stamp, frame):
    return struct.pack("<I", 0) + _time(stamp) + _text(frame)


def laser_scan(stamp, frame, scan, time_increment=0.0):
    step = scan.step
    head = struct.pack("<7f", scan.first, scan.first + step * (len(scan.ranges) - 1), step,
                       time_increment, 0.1, scan.least, scan.most)
    ranges = struct.pack(f"<I{len(scan.ranges)}f", len(scan.ranges), *scan.ranges)
    return _header(stamp, frame) + head + ranges + struct.pack("<I", 0)


def odometry(stamp, parent, child, pose):
    zeros = struct.pack("<36d", *([0.0] * 36))
    return (_header(stamp, parent) + _text(child) + struct.pack("<7d", *pose) + zeros +
            struct.pack("<6d", *([0.0] * 6)) + zeros)


def transforms(entries):
    """entries: (stamp, parent, child, pose)"""
    out = struct.pack("<I", len(entries))
    for stamp, parent, child, pose in entries:
        out += _header(stamp, parent) + _text(child) + struct.pack("<7d", *pose)
    return out


def image(stamp, frame, width, height, encoding, data):
    size = len(data) // (width * height)
    return (_header(stamp, frame) + struct.pack("<II", height, width) + _text(encoding) +
            struct.pack("<BII", 0, width * size, len(data)) + data)


def camera_info(stamp, frame, width, height, k):
    """k: fx, fy, cx, cy"""
    fx, fy, cx, cy = k
    matrix = struct.pack("<9d", fx, 0, cx, 0, fy, cy, 0, 0, 1)
    turn = struct.pack("<9d", 1, 0, 0, 0, 1, 0, 0, 0, 1)
    projection = struct.pack("<12d", fx, 0, cx, 0, 0, fy, cy, 0, 0, 0, 1, 0)
    return (_header(stamp, frame) + struct.pack("<II", height, width) + _text("plumb_bob") +
            struct.pack("<I5d", 5, 0, 0, 0, 0, 0) + matrix + turn + projection +
            struct.pack("<IIIIIIB", 0, 0, 0, 0, 0, 0, 0))


def _record(fields, data):
    head = b"".join(struct.pack("<I", len(name) + 1 + len(value)) + name + b"=" + value
                    for name, value in fields)
    return struct.pack("<I", len(head)) + head + struct.pack("<I", len(data)) + data


def write_bag(path, messages):
    """messages: (receipt time in ns, topic, type, bytes), in the order of recording."""
    topics = {}
    for _, topic, kind, _ in messages:
        topics.setdefault(topic, (len(topics), kind))

    def connection(topic):
        number, kind = topics[topic]
        about = [(b"topic", topic.encode()), (b"type", kind.encode()),
                 (b"md5sum", SUMS[kind].encode()), (b"message_definition", b"# as of ROS")]
        inner = b"".join(struct.pack("<I", len(n) + 1 + len(v)) + n + b"=" + v for n, v in about)
        return _record([(b"op", b"\x07"), (b"conn", struct.pack("<I", number)),
                        (b"topic", topic.encode())], inner)

    chunk, index = bytearray(), {topic: [] for topic in topics}
    for topic in topics:
        chunk += connection(topic)
    for receipt, topic, _, body in messages:
        index[topic].append((receipt, len(chunk)))
        chunk += _record([(b"op", b"\x02"), (b"conn", struct.pack("<I", topics[topic][0])),
                          (b"time", _time(receipt))], body)
    chunk_at = 13 + 4096
    out = _record([(b"op", b"\x05"), (b"compression", b"none"),
                   (b"size", struct.pack("<I", len(chunk)))], bytes(chunk))
    for topic, entries in index.items():
        data = b"".join(_time(receipt) + struct.pack("<I", at) for receipt, at in entries)
        out += _record([(b"op", b"\x04"), (b"ver", struct.pack("<I", 1)),
                        (b"conn", struct.pack("<I", topics[topic][0])),
                        (b"count", struct.pack("<I", len(entries)))], data)
    index_at = chunk_at + len(out)
    for topic in topics:
        out += connection(topic)
    counts = b"".join(struct.pack("<II", topics[t][0], len(e)) for t, e in index.items())
    times = [receipt for receipt, _, _, _ in messages]
    out += _record([(b"op", b"\x06"), (b"ver", struct.pack("<I", 1)),
                    (b"chunk_pos", struct.pack("<Q", chunk_at)), (b"start_time", _time(min(times))),
                    (b"end_time", _time(max(times))), (b"count", struct.pack("<I", len(topics)))],
                   counts)
    fields = [(b"op", b"\x03"), (b"index_pos", struct.pack("<Q", index_at)),
              (b"conn_count", struct.pack("<I", len(topics))),
              (b"chunk_count", struct.pack("<I", 1))]
    empty = _record(fields, b"")
    head = _record(fields, b" " * (4096 - len(empty)))
    path.write_bytes(b"#ROSBAG V2.0\n" + head + out)
