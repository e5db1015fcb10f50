"""Open3D, KISS-Matcher and small_gicp on the contact points of `touch2touch-bench registration`.

Called by the program as `python peers.py FOLDER`; FOLDER holds `request.json` (case and tool numbers) and
`request.npz` (contact points of each case, grasp frame; surface points of each tool, object frame; metres).
Writes `reply.json`: per method and case the planar part of grasp_from_object and the milliseconds it took.

The same search for all: ten starts about the closing axis, -22.5 to 22.5 degrees in steps of 5, the contact points as
the moving cloud, the tool's 5000 surface points as the fixed one (prepared once per tool, outside the timing), 15 mm of
reach, at most 100 iterations; the start with the lowest cost wins. Two search without a start: features and RANSAC, and
KISS-Matcher. `ms` is the clock, `cpu_ms` the processor. small_gicp works in millimetres, which its
defaults are made for.
"""

import json
import math
import sys
import time
from importlib.metadata import version
from pathlib import Path

import numpy as np

STARTS_DEG = np.arange(-22.5, 22.51, 5.0)
REACH_M = 0.015
ITERATIONS = 100
HUBER_M = 0.0005


def start_pose(degrees):
    """object_from_grasp for a tool turned by `degrees` about x."""
    c, s = math.cos(math.radians(-degrees)), math.sin(math.radians(-degrees))
    pose = np.eye(4)
    pose[1:3, 1:3] = [[c, -s], [s, c]]
    return pose


def planar(object_from_grasp, metres):
    """Angle about x and place in y, z of the inverse; the in-plane angle closest to the rotation."""
    pose = np.linalg.inv(object_from_grasp)
    theta = math.atan2(pose[2, 1] - pose[1, 2], pose[1, 1] + pose[2, 2])
    return {"theta_rad": theta, "y_m": pose[1, 3] * metres, "z_m": pose[2, 3] * metres}


def best_of(run):
    """The cheapest of the runs from all starts, and the time of all of them together."""
    begin = time.perf_counter()
    results = [run(start_pose(degrees)) for degrees in STARTS_DEG]
    cost, pose = min(results, key=lambda r: r[0])
    return pose, (time.perf_counter() - begin) * 1e3, cost


class Open3D:
    def __init__(self, o3d, plane):
        self.o3d = o3d
        self.registration = o3d.pipelines.registration
        self.plane = plane
        self.name = "open3d-point-to-plane" if plane else "open3d-point-to-point"
        self.label = "Open3D point to plane, Huber 0.5 mm" if plane else "Open3D point to point"
        self.tools = {}

    def cloud(self, points):
        return self.o3d.geometry.PointCloud(self.o3d.utility.Vector3dVector(points))

    def prepare(self, number, points):
        target = self.cloud(points)
        if self.plane:
            target.estimate_normals(self.o3d.geometry.KDTreeSearchParamKNN(20))
        self.tools[number] = target

    def solve(self, number, points):
        target = self.tools[number]
        if self.plane:
            kernel = self.registration.HuberLoss(HUBER_M)
            method = self.registration.TransformationEstimationPointToPlane(kernel)
        else:
            method = self.registration.TransformationEstimationPointToPoint()
        criteria = self.registration.ICPConvergenceCriteria(max_iteration=ITERATIONS)

        begin = time.perf_counter()
        source = self.cloud(points)
        prepared = (time.perf_counter() - begin) * 1e3

        def run(start):
            result = self.registration.registration_icp(source, target, REACH_M, start, method, criteria)
            # Without the share of points that found a partner, an empty match would have the lowest cost.
            cost = result.fitness * result.inlier_rmse**2 + (1.0 - result.fitness) * REACH_M**2
            return cost, result.transformation

        pose, ms, _ = best_of(run)
        return {**planar(pose, 1.0), "ms": ms + prepared}


class Anywhere:
    """A search without a start, then Open3D's ICP point to plane from where it ends. In millimetres: both have steps of a metre's
    order in mind."""

    VOXEL_MM = 1.5
    NEAR_MM = 2.5

    def __init__(self, o3d, kiss=None):
        self.o3d, self.kiss = o3d, kiss
        self.registration = o3d.pipelines.registration
        self.name = "kiss-matcher" if kiss else "open3d-fpfh-ransac"
        self.label = "KISS-Matcher, then ICP" if kiss else "Open3D FPFH and RANSAC, then ICP"
        self.tools = {}

    def cloud(self, points):
        cloud = self.o3d.geometry.PointCloud(self.o3d.utility.Vector3dVector(points * 1e3))
        cloud = cloud.voxel_down_sample(self.VOXEL_MM)
        cloud.estimate_normals(self.o3d.geometry.KDTreeSearchParamHybrid(2.0 * self.VOXEL_MM, 30))
        near = self.o3d.geometry.KDTreeSearchParamHybrid(5.0 * self.VOXEL_MM, 100)
        return cloud, None if self.kiss else self.registration.compute_fpfh_feature(cloud, near)

    def prepare(self, number, points):
        self.tools[number] = (*self.cloud(points), np.ascontiguousarray(points * 1e3))

    def anywhere(self, source, features, tool):
        target, target_features, points = tool
        if self.kiss:
            matcher = self.kiss.KISSMatcher(self.kiss.KISSMatcherConfig(self.VOXEL_MM))
            found = matcher.estimate(np.asarray(source.points), points)
            pose = np.eye(4)
            pose[:3, :3], pose[:3, 3] = found.rotation, np.ravel(found.translation)
            return pose
        near = self.registration.CorrespondenceCheckerBasedOnDistance(self.NEAR_MM)
        edges = self.registration.CorrespondenceCheckerBasedOnEdgeLength(0.9)
        return self.registration.registration_ransac_based_on_feature_matching(
            source,
            target,
            features,
            target_features,
            True,
            self.NEAR_MM,
            self.registration.TransformationEstimationPointToPoint(),
            3,
            [edges, near],
            self.registration.RANSACConvergenceCriteria(100_000, 0.999),
        ).transformation

    def solve(self, number, points):
        tool = self.tools[number]
        begin = time.perf_counter()
        start = self.anywhere(*self.cloud(points), tool)
        plane = self.registration.TransformationEstimationPointToPlane()
        source = self.o3d.geometry.PointCloud(self.o3d.utility.Vector3dVector(points * 1e3))
        pose = self.registration.registration_icp(source, tool[0], self.NEAR_MM, start, plane).transformation
        return {**planar(np.array(pose), 1e-3), "ms": (time.perf_counter() - begin) * 1e3}


class SmallGicp:
    LABELS = {"ICP": "small_gicp ICP", "PLANE_ICP": "small_gicp plane ICP", "GICP": "small_gicp GICP"}

    def __init__(self, module, kind):
        self.module = module
        self.kind = kind
        self.name = "small-gicp-" + {"ICP": "icp", "PLANE_ICP": "plane-icp", "GICP": "gicp"}[kind]
        self.label = self.LABELS[kind]
        self.tools = {}

    def cloud(self, points):
        cloud = self.module.PointCloud(np.ascontiguousarray(points * 1e3))
        tree = self.module.KdTree(cloud)
        if self.kind != "ICP":
            self.module.estimate_normals_covariances(cloud, tree, 20)
        return cloud, tree

    def prepare(self, number, points):
        self.tools[number] = self.cloud(points)

    def solve(self, number, points):
        target, tree = self.tools[number]
        begin = time.perf_counter()
        # Of the moving cloud, only GICP needs more than the points.
        source = self.cloud(points)[0] if self.kind == "GICP" else self.module.PointCloud(points * 1e3)
        prepared = (time.perf_counter() - begin) * 1e3

        def run(start):
            result = self.module.align(
                target,
                source,
                tree,
                start,
                registration_type=self.kind,
                max_correspondence_distance=REACH_M * 1e3,
                max_iterations=ITERATIONS,
                num_threads=1,
            )
            enough = result.num_inliers >= 0.5 * len(points)
            cost = result.error / max(result.num_inliers, 1) if enough else math.inf
            return cost, result.T_target_source

        pose, ms, _ = best_of(run)
        return {**planar(pose, 1e-3), "ms": ms + prepared}


def methods():
    found, versions, missing = [], {}, {}
    try:
        import open3d

        open3d.utility.set_verbosity_level(open3d.utility.VerbosityLevel.Error)
        found += [Open3D(open3d, False), Open3D(open3d, True), Anywhere(open3d)]
        versions["open3d"] = open3d.__version__
    except (ImportError, OSError) as error:
        missing["open3d"] = str(error)
    try:
        import kiss_matcher
        import open3d

        found.append(Anywhere(open3d, kiss_matcher))
        versions["kiss_matcher"] = version("kiss_matcher")
    except (ImportError, OSError) as error:
        missing["kiss_matcher"] = str(error)
    try:
        import small_gicp

        found += [SmallGicp(small_gicp, kind) for kind in ("ICP", "PLANE_ICP", "GICP")]
        versions["small_gicp"] = version("small_gicp")
    except (ImportError, OSError) as error:
        missing["small_gicp"] = str(error)
    return found, versions, missing


def main():
    folder = Path(sys.argv[1])
    cases = json.loads((folder / "request.json").read_text())["cases"]
    arrays = np.load(folder / "request.npz")
    found, versions, missing = methods()
    rows = []
    for method in found:
        for tool in sorted({tool for _, tool in cases}):
            method.prepare(tool, arrays[f"model_{tool}"])
        poses = []
        for case, tool in cases:
            points = arrays[f"points_{case}"]
            try:
                cpu = time.process_time()
                pose = method.solve(tool, points)
                poses.append({**pose, "cpu_ms": (time.process_time() - cpu) * 1e3})
            except (RuntimeError, ValueError, np.linalg.LinAlgError):
                # No pose: counted as a failure.
                poses.append(dict.fromkeys(("theta_rad", "y_m", "z_m", "ms", "cpu_ms")))
        rows.append({"name": method.name, "label": method.label, "poses": poses})
    reply = {"versions": versions, "missing": missing, "rows": rows}
    (folder / "reply.json").write_text(json.dumps(reply))


if __name__ == "__main__":
    main()
