"""Bags of ``synfeal export --to rosbag``, read back by rosbags."""

import sys

import numpy as np
import pytest
from PIL import Image
from rosbags.highlevel import AnyReader
from rosbags.typesys import Stores, get_typestore
from scipy.spatial.transform import Rotation

from synfeal.cli import main
from tests.support.collected import refused
from tests.support.damaged_sets import frame_files
from tests.support.small_disk import mounted

TOPICS = {
    "/camera/color/image_raw": "sensor_msgs/msg/Image",
    "/camera/color/camera_info": "sensor_msgs/msg/CameraInfo",
    "/camera/depth/image_raw": "sensor_msgs/msg/Image",
    "/camera/depth/camera_info": "sensor_msgs/msg/CameraInfo",
    "/odom": "nav_msgs/msg/Odometry",
    "/tf": "tf2_msgs/msg/TFMessage",
}


def export(dataset, out, *more):
    return main(["export", str(dataset), "--to", "rosbag", "--out", str(out), *more])


def read_bag(path):
    """Messages of each topic in order, with the time at which they were recorded."""
    messages = {}
    with AnyReader([path], default_typestore=get_typestore(Stores.ROS2_HUMBLE)) as reader:
        assert {c.topic: c.msgtype for c in reader.connections}.items() <= TOPICS.items()
        for connection, time_ns, raw in reader.messages():
            message = reader.deserialize(raw, connection.msgtype)
            messages.setdefault(connection.topic, []).append((time_ns, message))
    return messages


def stamp_ns(header):
    return header.stamp.sec * 10**9 + header.stamp.nanosec


def matrix(position, orientation):
    pose = np.eye(4)
    quat = [orientation.x, orientation.y, orientation.z, orientation.w]
    pose[:3, :3] = Rotation.from_quat(quat).as_matrix()
    pose[:3, 3] = position.x, position.y, position.z
    return pose


@pytest.fixture(scope="module")
def exported(planar, tmp_path_factory):
    out = tmp_path_factory.mktemp("bags") / "out"
    assert export(planar, out) == 0
    return out


@pytest.mark.parametrize(("sequence", "count"), [("seq-01", 24), ("seq-02", 8)])
def test_pixels_and_poses_are_read_back_as_they_are(planar, exported, sequence, count):
    bag = read_bag(exported / sequence)
    assert bag.keys() == TOPICS.keys()
    assert {len(messages) for messages in bag.values()} == {count}
    poses = frame_files(planar, "pose.txt", sequence)
    assert len(poses) == count
    for index, path in enumerate(poses):
        due_ns = 10**9 + index * 10**9 // 30
        color = np.asarray(Image.open(str(path).replace("pose.txt", "color.png")))
        depth_mm = np.asarray(Image.open(str(path).replace("pose.txt", "depth.png")))
        time_ns, shown = bag["/camera/color/image_raw"][index]
        assert (time_ns, stamp_ns(shown.header)) == (due_ns, due_ns)
        assert (shown.encoding, shown.step, shown.is_bigendian) == ("rgb8", 3 * shown.width, 0)
        pixels = shown.data.reshape(shown.height, shown.width, 3)
        np.testing.assert_array_equal(pixels, color)
        _, measured = bag["/camera/depth/image_raw"][index]
        assert (measured.encoding, measured.step) == ("16UC1", 2 * measured.width)
        read_mm = measured.data.view("<u2").reshape(measured.height, measured.width)
        np.testing.assert_array_equal(read_mm, np.where(depth_mm == 65535, 0, depth_mm))
        _, odometry = bag["/odom"][index]
        assert stamp_ns(odometry.header) == due_ns
        assert odometry.header.frame_id == "world"
        found = matrix(odometry.pose.pose.position, odometry.pose.pose.orientation)
        np.testing.assert_allclose(found, np.loadtxt(path), atol=1e-9)
        (transform,) = bag["/tf"][index][1].transforms
        moved = matrix(transform.transform.translation, transform.transform.rotation)
        np.testing.assert_array_equal(moved, found)
        frames = {odometry.child_frame_id, transform.child_frame_id, shown.header.frame_id}
        assert frames == {measured.header.frame_id} == {"camera_color_optical_frame"}


def test_the_camera_is_opencvs(planar, tmp_path):
    lens = tmp_path / "cameras.txt"
    lens.write_text("1 FULL_OPENCV 96 72 80 81 47 37 0.1 -0.05 0.001 -0.002 0.01 0 0 0\n")
    assert export(planar, tmp_path / "out", "--camera", str(lens)) == 0
    bag = read_bag(tmp_path / "out/seq-01")
    for topic in ("/camera/color/camera_info", "/camera/depth/camera_info"):
        _, info = bag[topic][0]
        assert (info.width, info.height, info.distortion_model) == (96, 72, "plumb_bob")
        # The first pixel's centre is (0, 0) to OpenCV and (0.5, 0.5) to COLMAP.
        expected = np.array([[80, 0, 46.5], [0, 81, 36.5], [0, 0, 1]])
        np.testing.assert_array_equal(info.k.reshape(3, 3), expected)
        np.testing.assert_array_equal(info.p.reshape(3, 4)[:, :3], expected)
        np.testing.assert_array_equal(info.d, [0.1, -0.05, 0.001, -0.002, 0.01])
        np.testing.assert_array_equal(info.r.reshape(3, 3), np.eye(3))


def test_splits_are_kept_and_nothing_but_the_bags_is_written(exported):
    assert (exported / "TestSplit.txt").read_text() == "sequence2\n"
    names = sorted(path.relative_to(exported).as_posix() for path in exported.rglob("*"))
    assert names == [
        *("TestSplit.txt", "TrainSplit.txt"),
        *("seq-01", "seq-01/metadata.yaml", "seq-01/seq-01.db3"),
        *("seq-02", "seq-02/metadata.yaml", "seq-02/seq-02.db3"),
    ]


def test_without_depth_there_are_no_depth_topics(damaged, tmp_path):
    for path in damaged.rglob("*.depth.png"):
        path.unlink()
    assert export(damaged, tmp_path / "out") == 0
    assert read_bag(tmp_path / "out/seq-01").keys() == TOPICS.keys() - {
        "/camera/depth/image_raw",
        "/camera/depth/camera_info",
    }


def test_without_the_package_one_line_says_what_to_install(planar, tmp_path, capsys, monkeypatch):
    monkeypatch.setitem(sys.modules, "rosbags.typesys", None)
    line = refused(capsys, "export", planar, "--to", "rosbag", "--out", tmp_path / "out")
    assert "pip install 'synfeal[ros]'" in line
    assert not (tmp_path / "out").exists()


def test_a_full_disk_is_one_line(planar, tmp_path, capfd):
    with mounted(tmp_path / "disk", "64k") as disk:
        line = refused(capfd, "export", planar, "--to", "rosbag", "--out", disk / "out")
        assert "No space left on device" in line
        assert list(disk.iterdir()) == []
