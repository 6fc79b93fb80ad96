"""Logs that say how many rows or messages they have are refused where they have others."""

import numpy as np
import pytest

import flexura as fx
from flexura.io.logs import read_log, understood
from foreign_logs import bag, json_mcap, lvm_file, numbers

T, A, W, F = numbers()


def plain_mcap(path, count=100, summary=True, data_crcs=False):
    """An MCAP file without checksums of its chunks: 2 topics in JSON, one chunk."""
    from mcap.writer import CompressionType, Writer

    with open(path, "wb") as stream:
        writer = Writer(
            stream,
            enable_crcs=False,
            enable_data_crcs=data_crcs,
            use_statistics=summary,
            use_chunking=not data_crcs,
            compression=CompressionType.NONE,
        )
        writer.start()
        schema = writer.register_schema("x", "jsonschema", b"{}")
        topics = [writer.register_channel(name, "json", schema) for name in ("/arm", "/load")]
        for k in range(count):
            for topic in topics:
                at = 10**18 + k * 10**7
                writer.add_message(topic, at, b'{"angle": %d}' % k, at)
        writer.finish()
    return path


def changed(path, at, byte):
    raw = bytearray(path.read_bytes())
    raw[at] = byte
    path.write_bytes(raw)
    return path


def of_message(raw, k):
    """Where the record of message k begins: after it 8 bytes of length, 2 of its channel, 4 of its
    sequence, 8 of its log time."""
    return raw.index(b'{"angle": %d}' % k) - 8 - 8 - 4 - 2 - 8 - 1


def test_an_mcap_file_without_checksums_has_the_messages_that_it_says(tmp_path):
    path = plain_mcap(tmp_path / "a.mcap")
    assert len(understood(read_log(path), every=True).run) == 100
    raw = path.read_bytes()
    at = of_message(raw, 40)
    changed(path, at + 1 + 5, 1)  # a record that takes in all that follow it
    with pytest.raises(fx.InputError, match=r"a.mcap"):
        read_log(path)
    path.write_bytes(raw)
    changed(path, at, 0x81)  # a record of a kind that is skipped
    with pytest.raises(fx.InputError, match=r"/arm: .* 99 messages, the file's statistics say 100"):
        read_log(path)
    path.write_bytes(raw)
    changed(path, at + 9, 2)  # of the other topic
    with pytest.raises(fx.InputError, match=r"(99|101) messages, .* say 100"):
        read_log(path)
    path.write_bytes(raw)
    changed(path, of_message(raw, 99) + 15 + 6, 99)  # a log time in another century
    with pytest.raises(fx.InputError, match=r"log times from .* statistics say .* s"):
        read_log(path)


def test_an_mcap_file_without_statistics_is_read(tmp_path):
    path = plain_mcap(tmp_path / "a.mcap", summary=False)
    assert len(understood(read_log(path), every=True).run) == 100


def test_the_checksum_of_messages_outside_of_chunks_is_compared(tmp_path):
    path = plain_mcap(tmp_path / "a.mcap", data_crcs=True)
    assert len(understood(read_log(path), every=True).run) == 100
    raw = path.read_bytes()
    changed(path, raw.index(b'{"angle": 50}') + 10, ord("6"))
    with pytest.raises(fx.InputError, match="crc validation failed"):
        read_log(path)


def test_messages_are_in_the_order_of_their_log_times(tmp_path):
    order = np.random.default_rng(3).permutation(len(T))
    path = json_mcap(tmp_path / "a.mcap", T[order], [A[order]], ["a"])
    run = understood(read_log(path), every=True).run
    assert (run["sensor/rig/state.a"] == A).all()


@pytest.mark.parametrize("storage", ["sqlite3", "mcap"])
def test_a_bag_has_the_messages_that_its_metadata_say(storage, tmp_path):
    place = bag(tmp_path / "bag", T, (A, W, F), storage)
    about = place / "metadata.yaml"
    about.write_text(about.read_text().replace(f"message_count: {len(T)}", "message_count: 250"))
    said = f"/joint_states: .* {len(T)} messages, the counts in its metadata.yaml say 250"
    with pytest.raises(fx.InputError, match=said):
        read_log(place)


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("Channels\t3", "Channels\t4", "3 channels, the header says 4"),
        ("240\t240\t240", "240\t241\t240", "channel 2 has 240 rows, the header says 241 samples"),
    ],
)
@pytest.mark.parametrize("layout", ["One", "Multi", "No"])
def test_a_segment_of_labview_has_the_channels_and_rows_that_it_says(
    layout, old, new, said, tmp_path
):
    path = lvm_file(tmp_path / "a.lvm", T, (A, W, F), layout=layout)
    path.write_text(path.read_text().replace(old, new, 1))
    with pytest.raises(fx.InputError, match=said):
        read_log(path)


def test_channels_of_one_name_are_told_apart(tmp_path):
    path = lvm_file(tmp_path / "a.lvm", T, (A, W, F))
    path.write_text(path.read_text().replace("Deflection", "Angle"))
    run = understood(read_log(path), every=True).run
    assert list(run) == ["sensor/Angle", "sensor/Angle_2", "sensor/Force"]
    assert (run["sensor/Angle_2"] == W).all()


def test_a_bag_of_ros_1_has_the_messages_that_its_index_says(tmp_path):
    from rosbags.rosbag1 import Writer
    from rosbags.typesys import Stores, get_typestore

    store = get_typestore(Stores.ROS1_NOETIC)
    kind = "std_msgs/msg/Float64"
    path = tmp_path / "a.bag"
    with Writer(path) as writer:
        connection = writer.add_connection("/force", kind, typestore=store)
        for k, value in enumerate(F.tolist()):
            raw = store.serialize_ros1(store.types[kind](value), kind)
            writer.write(connection, 10**18 + 10**7 * k, raw)
    found = understood(read_log(path), every=True)
    assert (found.run["sensor/force"] == F).all() and "no stamps" in found.clock
    raw = path.read_bytes()
    count = len(F).to_bytes(4, "little")
    at = raw.rindex(count)  # of the record of the chunk, at the end
    path.write_bytes(raw[:at] + (len(F) + 9).to_bytes(4, "little") + raw[at + 4 :])
    with pytest.raises(
        fx.InputError, match=r"/force: .* 240 messages, the counts in its index say"
    ):
        read_log(path)
