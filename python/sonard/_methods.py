# SPDX-License-Identifier: MIT
# Written by python/generate_methods from the schema of the protocol.
"""A method for each of the daemon's."""
from __future__ import annotations

from typing import Any, Dict, List, Literal, Optional, Sequence, cast

from . import results
from ._answers import Blocked, Collision, Limit, Sector


class Methods:
    """What is None is not sent."""

    def _ask(self, method: str, params: Dict[str, Any]) -> Any:
        raise NotImplementedError

    def blocked(self, azimuth_deg: float, distance_m: float, *, elevation_deg: Optional[float] = None,
            half_angle_deg: Optional[float] = None, radius_m: Optional[float] = None, frame: Optional[Literal["body",
            "ned"]] = None, grid: Optional[str] = None) -> Blocked:
        """Is a direction free?
        azimuth_deg: direction, clockwise from forward or north; in degrees.
        distance_m: how far to look ahead; in m.
        elevation_deg: upward; in degrees; 0 unless given.
        half_angle_deg: half the opening of a cone around the direction; in degrees; 7.5 unless given.
        radius_m: of a corridor along the direction, instead of a cone; in m.
        frame: azimuth 0 is forward (body) or north (ned); "body" unless given.
        grid: name of the grid to ask.
        """
        return cast("Blocked", self._ask("blocked", {"azimuth_deg": azimuth_deg, "distance_m": distance_m,
            "elevation_deg": elevation_deg, "half_angle_deg": half_angle_deg, "radius_m": radius_m, "frame": frame,
            "grid": grid}))

    def explain(self, azimuth_deg: float, distance_m: float, *, elevation_deg: Optional[float] = None,
            half_angle_deg: Optional[float] = None, frame: Optional[Literal["body", "ned"]] = None,
            grid: Optional[str] = None, count: Optional[int] = None) -> results.ExplainResult:
        """The echoes and pings behind an answer about a direction.
        azimuth_deg: direction, clockwise from forward or north; in degrees.
        distance_m: how far to look ahead; in m.
        elevation_deg: upward; in degrees; 0 unless given.
        half_angle_deg: half the opening of a cone around the direction; in degrees; 7.5 unless given.
        frame: azimuth 0 is forward (body) or north (ned); "body" unless given.
        grid: name of the grid to ask.
        count: most cells, and pings, to list; 8 unless given.
        """
        return cast("results.ExplainResult", self._ask("explain", {"azimuth_deg": azimuth_deg,
            "distance_m": distance_m, "elevation_deg": elevation_deg, "half_angle_deg": half_angle_deg, "frame": frame,
            "grid": grid, "count": count}))

    def sectors(self, *, count: Optional[int] = None, frame: Optional[Literal["body", "ned"]] = None,
            elevation_deg: Optional[Sequence[float]] = None, distance_m: Optional[float] = None,
            grid: Optional[str] = None) -> List[Sector]:
        """State, range and age all around.
        count: number of sectors around; 72 unless given.
        frame: azimuth 0 is forward (body) or north (ned); "body" unless given.
        elevation_deg: lowest and highest; in degrees; [-5, 5] unless given.
        distance_m: how far to judge; 0: the range of the sonars; in m.
        grid: name of the grid to ask.
        """
        return cast("List[Sector]", self._ask("sectors", {"count": count, "frame": frame,
            "elevation_deg": elevation_deg, "distance_m": distance_m, "grid": grid}))

    def nearest(self, *, frame: Optional[Literal["body", "ned"]] = None, azimuth_deg: Optional[Sequence[float]] = None,
            elevation_deg: Optional[Sequence[float]] = None, distance_m: Optional[float] = None,
            grid: Optional[str] = None) -> results.NearestResult:
        """The nearest obstacle, and how much of the water nearer than it is unknown.
        frame: azimuth 0 is forward (body) or north (ned); "body" unless given.
        azimuth_deg: from and to, clockwise; in degrees.
        elevation_deg: lowest and highest; in degrees; [-90, 90] unless given.
        distance_m: obstacles farther away do not count; in m.
        grid: name of the grid to ask.
        """
        return cast("results.NearestResult", self._ask("nearest", {"frame": frame, "azimuth_deg": azimuth_deg,
            "elevation_deg": elevation_deg, "distance_m": distance_m, "grid": grid}))

    def time_to_collision(self, *, velocity_mps: Optional[Sequence[float]] = None, frame: Optional[Literal["body",
            "ned"]] = None, ahead_s: Optional[float] = None, grid: Optional[str] = None) -> Collision:
        """When does the vehicle meet something?
        velocity_mps: forward, right, down, or with frame ned north, east, down; in m/s.
        frame: axes of velocity_mps.
        ahead_s: how far to look ahead; in s; 60 unless given.
        grid: name of the grid to ask.
        """
        return cast("Collision", self._ask("time_to_collision", {"velocity_mps": velocity_mps, "frame": frame,
            "ahead_s": ahead_s, "grid": grid}))

    def limit(self, velocity_mps: Sequence[float], *, frame: Optional[Literal["body", "ned"]] = None,
            grid: Optional[str] = None) -> Limit:
        """How fast may the vehicle go, to stop in water known to be free?
        velocity_mps: forward, right, down, or with frame ned north, east, down; in m/s.
        frame: azimuth 0 is forward (body) or north (ned); "body" unless given.
        grid: name of the grid to ask.
        """
        return cast("Limit", self._ask("limit", {"velocity_mps": velocity_mps, "frame": frame, "grid": grid}))

    def pose(self, *, t_unix: Optional[float] = None, position_m: Optional[Sequence[float]] = None,
            depth_m: Optional[float] = None, attitude_deg: Optional[Sequence[float]] = None,
            quaternion: Optional[Sequence[float]] = None, velocity_mps: Optional[Sequence[float]] = None,
            altitude_m: Optional[float] = None, speed_bound_mps: Optional[Sequence[float]] = None,
            no_speed_bound: Optional[Literal["messages", "rate", "parameters", "frame", "motors", "sticks", "pulses",
            "clock", "vehicle"]] = None, push_n: Optional[Sequence[float]] = None) -> None:
        """Where the vehicle is.
        t_unix: Unix time of the measurement; in s.
        position_m: north, east, down; in m.
        depth_m: below the surface; in m.
        attitude_deg: roll, pitch, yaw; in degrees.
        quaternion: w, x, y, z, body to north-east-down, instead.
        velocity_mps: north, east, down; in m/s.
        altitude_m: above the bottom, straight down; in m.
        speed_bound_mps: the most that it has gone through the water since the bound before, level and up or down; in m/s.
        no_speed_bound: why there is none from now on.
        push_n: which way its thrusters push it, forward and to the right; in N.
        """
        self._ask("pose", {"t_unix": t_unix, "position_m": position_m, "depth_m": depth_m,
            "attitude_deg": attitude_deg, "quaternion": quaternion, "velocity_mps": velocity_mps,
            "altitude_m": altitude_m, "speed_bound_mps": speed_bound_mps, "no_speed_bound": no_speed_bound,
            "push_n": push_n})

    def pose_withdraw(self) -> None:
        """Go on without a pose, as if none had ever been given."""
        self._ask("pose_withdraw", {})

    def status(self) -> results.StatusResult:
        """What the daemon and its sonars do."""
        return cast("results.StatusResult", self._ask("status", {}))

    def sensors(self) -> results.SensorsResult:
        """What every sonar is, where it sits and what it does."""
        return cast("results.SensorsResult", self._ask("sensors", {}))

    def stats(self) -> results.StatsResult:
        """Counters and latencies."""
        return cast("results.StatsResult", self._ask("stats", {}))

    def plan(self) -> results.PlanResult:
        """Which stages run, which are left out, why, and their memory."""
        return cast("results.PlanResult", self._ask("plan", {}))

    def version(self) -> results.VersionResult:
        """Versions of the daemon and of the protocol."""
        return cast("results.VersionResult", self._ask("version", {}))

    def image(self, *, sensor: Optional[str] = None, newer_s: Optional[float] = None) -> results.ImageResult:
        """The last turn of a sonar as a picture.
        sensor: name of the sonar.
        newer_s: leave out rows that were pinged longer ago; in s.
        """
        return cast("results.ImageResult", self._ask("image", {"sensor": sensor, "newer_s": newer_s}))

    def clusters(self, *, count: Optional[int] = None, grid: Optional[str] = None) -> results.ClustersResult:
        """What the obstacles form together.
        count: list at most so many, the nearest; 64 unless given.
        grid: name of the grid to ask.
        """
        return cast("results.ClustersResult", self._ask("clusters", {"count": count, "grid": grid}))

    def next_look(self, *, count: Optional[int] = None, elevation_deg: Optional[Sequence[float]] = None,
            apart_deg: Optional[float] = None, grid: Optional[str] = None) -> results.NextLookResult:
        """Which directions to look at next, and why.
        count: list at most so many directions; 8 unless given.
        elevation_deg: lowest and highest; in degrees; [-5, 5] unless given.
        apart_deg: leave out what is nearer to a better direction; in degrees; 10 unless given.
        grid: name of the grid to ask.
        """
        return cast("results.NextLookResult", self._ask("next_look", {"count": count, "elevation_deg": elevation_deg,
            "apart_deg": apart_deg, "grid": grid}))

    def grid_lock(self, azimuth_deg: float, *, elevation_deg: Optional[float] = None,
            half_angle_deg: Optional[float] = None, from_m: Optional[float] = None, to_m: Optional[float] = None,
            locked: Optional[bool] = None, grid: Optional[str] = None) -> results.GridLockResult:
        """Lock cells, which then neither change nor fade, or unlock them.
        azimuth_deg: axis of a cone, in the axes of the grid; in degrees.
        elevation_deg: upward; in degrees; 0 unless given.
        half_angle_deg: half the opening of the cone; in degrees; 5 unless given.
        from_m: cells not nearer than this; in m; 0 unless given.
        to_m: cells not farther than this; in m; 10000 unless given.
        locked: false unlocks; true unless given.
        grid: name of the grid to ask.
        """
        return cast("results.GridLockResult", self._ask("grid_lock", {"azimuth_deg": azimuth_deg,
            "elevation_deg": elevation_deg, "half_angle_deg": half_angle_deg, "from_m": from_m, "to_m": to_m,
            "locked": locked, "grid": grid}))

    def background(self, *, sensor: Optional[str] = None, picture: Optional[Literal["no",
            "yes"]] = None) -> results.BackgroundResult:
        """What a sonar hears of the vehicle itself.
        sensor: name of the sonar.
        picture: also the rows of the template; "no" unless given.
        """
        return cast("results.BackgroundResult", self._ask("background", {"sensor": sensor, "picture": picture}))

    def background_learn(self, *, sensor: Optional[str] = None, pings: Optional[int] = None,
            motion: Optional[Literal["wanted", "any"]] = None) -> results.BackgroundResult:
        """Learn a background template.
        sensor: name of the sonar.
        pings: pings of each direction; 15 unless given.
        motion: take pings only as the vehicle moves, or any; "wanted" unless given.
        """
        return cast("results.BackgroundResult", self._ask("background_learn", {"sensor": sensor, "pings": pings,
            "motion": motion}))

    def background_stop(self, *, sensor: Optional[str] = None, use: Optional[Literal["no",
            "yes"]] = None) -> results.BackgroundResult:
        """End learning.
        sensor: name of the sonar.
        use: make the template of what there is; "no" unless given.
        """
        return cast("results.BackgroundResult", self._ask("background_stop", {"sensor": sensor, "use": use}))

    def background_save(self, *, sensor: Optional[str] = None) -> results.BackgroundResult:
        """Save the template in force to the configured file.
        sensor: name of the sonar.
        """
        return cast("results.BackgroundResult", self._ask("background_save", {"sensor": sensor}))

    def background_load(self, *, sensor: Optional[str] = None) -> results.BackgroundResult:
        """Load the template from the configured file.
        sensor: name of the sonar.
        """
        return cast("results.BackgroundResult", self._ask("background_load", {"sensor": sensor}))

    def background_forget(self, *, sensor: Optional[str] = None) -> results.BackgroundResult:
        """Take the template out of force.
        sensor: name of the sonar.
        """
        return cast("results.BackgroundResult", self._ask("background_forget", {"sensor": sensor}))

    def point(self, position_m: Sequence[float], *, frame: Optional[Literal["ned",
            "body"]] = None) -> results.PointResult:
        """Is this place free?
        position_m: the place; in m.
        frame: north, east, down from the origin of the poses, or forward, right, down from the vehicle; "ned" unless given.
        """
        return cast("results.PointResult", self._ask("point", {"position_m": position_m, "frame": frame}))

    def box(self, from_m: Sequence[float], to_m: Sequence[float]) -> results.BoxResult:
        """Is all of the box between two places free?
        from_m: one corner: north, east, down; in m.
        to_m: the corner opposite; in m.
        """
        return cast("results.BoxResult", self._ask("box", {"from_m": from_m, "to_m": to_m}))

    def path(self, points_m: Sequence[Sequence[float]], radius_m: float, *, frame: Optional[Literal["ned",
            "body"]] = None) -> results.PathResult:
        """May a body pass along these places?
        points_m: way points; in m.
        radius_m: of the body that passes; in m.
        frame: north, east, down from the origin of the poses, or forward, right, down from the vehicle; "ned" unless given.
        """
        return cast("results.PathResult", self._ask("path", {"points_m": points_m, "radius_m": radius_m,
            "frame": frame}))

    def map(self) -> results.MapResult:
        """The voxel map: its state and its jobs."""
        return cast("results.MapResult", self._ask("map", {}))

    def map_slice(self, *, middle_m: Optional[Sequence[float]] = None, depth_m: Optional[float] = None,
            size_m: Optional[float] = None, cells: Optional[int] = None) -> results.MapSliceResult:
        """A level picture of the map.
        middle_m: north, east of its middle; in m.
        depth_m: below the surface; in m.
        size_m: side of the picture; in m; 40 unless given.
        cells: along a side; 160 unless given.
        """
        return cast("results.MapSliceResult", self._ask("map_slice", {"middle_m": middle_m, "depth_m": depth_m,
            "size_m": size_m, "cells": cells}))

    def map_new(self) -> results.MapResult:
        """Begin a new submap with the next ping."""
        return cast("results.MapResult", self._ask("map_new", {}))

    def map_forget(self) -> results.MapResult:
        """Forget the whole map."""
        return cast("results.MapResult", self._ask("map_forget", {}))

    def map_submaps(self) -> results.MapSubmapsResult:
        """What the map is made of."""
        return cast("results.MapSubmapsResult", self._ask("map_submaps", {}))

    def map_move(self, id: int, position_m: Sequence[float], *, attitude_deg: Optional[Sequence[float]] = None,
            quaternion: Optional[Sequence[float]] = None) -> results.Submap:
        """Move a submap to where it really lies.
        id: of the submap.
        position_m: north, east, down of its base; in m.
        attitude_deg: roll, pitch, yaw; in degrees.
        quaternion: w, x, y, z, body to north-east-down, instead.
        """
        return cast("results.Submap", self._ask("map_move", {"id": id, "position_m": position_m,
            "attitude_deg": attitude_deg, "quaternion": quaternion}))

    def surface(self, *, cursor: Optional[Optional[str]] = None, count: Optional[int] = None) -> results.SurfaceResult:
        """Where the free water of the map ends, page by page.
        cursor: of the page before.
        count: points of a page; 256 unless given.
        """
        return cast("results.SurfaceResult", self._ask("surface", {"cursor": cursor, "count": count}))

    def map_save(self, name: str) -> results.MapResult:
        """Save the map.
        name: of the file, without its ending: 1 to 64 letters, digits, - and _.
        """
        return cast("results.MapResult", self._ask("map_save", {"name": name}))

    def map_load(self, name: str) -> results.MapResult:
        """Put a saved map in place of this one.
        name: of the file, without its ending: 1 to 64 letters, digits, - and _.
        """
        return cast("results.MapResult", self._ask("map_load", {"name": name}))

    def map_export(self, name: str, *, format: Optional[Literal["ply", "mcap", "bt"]] = None) -> results.MapResult:
        """Write the surface or the voxels for other programs.
        name: of the file, without its ending: 1 to 64 letters, digits, - and _.
        format: of the file; "ply" unless given.
        """
        return cast("results.MapResult", self._ask("map_export", {"name": name, "format": format}))

    def grid_list(self) -> results.GridListResult:
        """The spherical grids."""
        return cast("results.GridListResult", self._ask("grid_list", {}))

    def grid_cells(self, *, cursor: Optional[Optional[str]] = None, count: Optional[int] = None,
            grid: Optional[str] = None) -> results.GridCellsResult:
        """Every cell of a spherical grid, page by page.
        cursor: of the page before.
        count: cells of a page, at most; 256 unless given.
        grid: name of the grid to ask.
        """
        return cast("results.GridCellsResult", self._ask("grid_cells", {"cursor": cursor, "count": count,
            "grid": grid}))

    def record_start(self) -> results.RecordState:
        """Begin to record, in a new file."""
        return cast("results.RecordState", self._ask("record_start", {}))

    def record_stop(self) -> results.RecordState:
        """Complete the recording's file, and record nothing."""
        return cast("results.RecordState", self._ask("record_stop", {}))

    def reload(self) -> results.ReloadResult:
        """Read the configuration again."""
        return cast("results.ReloadResult", self._ask("reload", {}))

    def reload_check(self, *, file: Optional[str] = None, text: Optional[str] = None) -> results.ReloadResult:
        """What a reload would say; nothing changes.
        file: of the configuration's folder, as an absolute path without links, there or not.
        text: what that file holds instead.
        """
        return cast("results.ReloadResult", self._ask("reload_check", {"file": file, "text": text}))

    def replay(self, *, pause: Optional[Literal["no", "yes"]] = None, speed: Optional[float] = None,
            to_s: Optional[float] = None) -> results.ReplayState:
        """Pause a capture that is played, or jump in it.
        pause: yes: the clock stands.
        speed: 1: as recorded; 0: as fast as it goes.
        to_s: jump to so long after the first message; in s.
        """
        return cast("results.ReplayState", self._ask("replay", {"pause": pause, "speed": speed, "to_s": to_s}))


class AsyncMethods:
    """What is None is not sent."""

    async def _ask(self, method: str, params: Dict[str, Any]) -> Any:
        raise NotImplementedError

    async def blocked(self, azimuth_deg: float, distance_m: float, *, elevation_deg: Optional[float] = None,
            half_angle_deg: Optional[float] = None, radius_m: Optional[float] = None, frame: Optional[Literal["body",
            "ned"]] = None, grid: Optional[str] = None) -> Blocked:
        """Is a direction free?
        azimuth_deg: direction, clockwise from forward or north; in degrees.
        distance_m: how far to look ahead; in m.
        elevation_deg: upward; in degrees; 0 unless given.
        half_angle_deg: half the opening of a cone around the direction; in degrees; 7.5 unless given.
        radius_m: of a corridor along the direction, instead of a cone; in m.
        frame: azimuth 0 is forward (body) or north (ned); "body" unless given.
        grid: name of the grid to ask.
        """
        return cast("Blocked", await self._ask("blocked", {"azimuth_deg": azimuth_deg, "distance_m": distance_m,
            "elevation_deg": elevation_deg, "half_angle_deg": half_angle_deg, "radius_m": radius_m, "frame": frame,
            "grid": grid}))

    async def explain(self, azimuth_deg: float, distance_m: float, *, elevation_deg: Optional[float] = None,
            half_angle_deg: Optional[float] = None, frame: Optional[Literal["body", "ned"]] = None,
            grid: Optional[str] = None, count: Optional[int] = None) -> results.ExplainResult:
        """The echoes and pings behind an answer about a direction.
        azimuth_deg: direction, clockwise from forward or north; in degrees.
        distance_m: how far to look ahead; in m.
        elevation_deg: upward; in degrees; 0 unless given.
        half_angle_deg: half the opening of a cone around the direction; in degrees; 7.5 unless given.
        frame: azimuth 0 is forward (body) or north (ned); "body" unless given.
        grid: name of the grid to ask.
        count: most cells, and pings, to list; 8 unless given.
        """
        return cast("results.ExplainResult", await self._ask("explain", {"azimuth_deg": azimuth_deg,
            "distance_m": distance_m, "elevation_deg": elevation_deg, "half_angle_deg": half_angle_deg, "frame": frame,
            "grid": grid, "count": count}))

    async def sectors(self, *, count: Optional[int] = None, frame: Optional[Literal["body", "ned"]] = None,
            elevation_deg: Optional[Sequence[float]] = None, distance_m: Optional[float] = None,
            grid: Optional[str] = None) -> List[Sector]:
        """State, range and age all around.
        count: number of sectors around; 72 unless given.
        frame: azimuth 0 is forward (body) or north (ned); "body" unless given.
        elevation_deg: lowest and highest; in degrees; [-5, 5] unless given.
        distance_m: how far to judge; 0: the range of the sonars; in m.
        grid: name of the grid to ask.
        """
        return cast("List[Sector]", await self._ask("sectors", {"count": count, "frame": frame,
            "elevation_deg": elevation_deg, "distance_m": distance_m, "grid": grid}))

    async def nearest(self, *, frame: Optional[Literal["body", "ned"]] = None,
            azimuth_deg: Optional[Sequence[float]] = None, elevation_deg: Optional[Sequence[float]] = None,
            distance_m: Optional[float] = None, grid: Optional[str] = None) -> results.NearestResult:
        """The nearest obstacle, and how much of the water nearer than it is unknown.
        frame: azimuth 0 is forward (body) or north (ned); "body" unless given.
        azimuth_deg: from and to, clockwise; in degrees.
        elevation_deg: lowest and highest; in degrees; [-90, 90] unless given.
        distance_m: obstacles farther away do not count; in m.
        grid: name of the grid to ask.
        """
        return cast("results.NearestResult", await self._ask("nearest", {"frame": frame, "azimuth_deg": azimuth_deg,
            "elevation_deg": elevation_deg, "distance_m": distance_m, "grid": grid}))

    async def time_to_collision(self, *, velocity_mps: Optional[Sequence[float]] = None,
            frame: Optional[Literal["body", "ned"]] = None, ahead_s: Optional[float] = None,
            grid: Optional[str] = None) -> Collision:
        """When does the vehicle meet something?
        velocity_mps: forward, right, down, or with frame ned north, east, down; in m/s.
        frame: axes of velocity_mps.
        ahead_s: how far to look ahead; in s; 60 unless given.
        grid: name of the grid to ask.
        """
        return cast("Collision", await self._ask("time_to_collision", {"velocity_mps": velocity_mps, "frame": frame,
            "ahead_s": ahead_s, "grid": grid}))

    async def limit(self, velocity_mps: Sequence[float], *, frame: Optional[Literal["body", "ned"]] = None,
            grid: Optional[str] = None) -> Limit:
        """How fast may the vehicle go, to stop in water known to be free?
        velocity_mps: forward, right, down, or with frame ned north, east, down; in m/s.
        frame: azimuth 0 is forward (body) or north (ned); "body" unless given.
        grid: name of the grid to ask.
        """
        return cast("Limit", await self._ask("limit", {"velocity_mps": velocity_mps, "frame": frame, "grid": grid}))

    async def pose(self, *, t_unix: Optional[float] = None, position_m: Optional[Sequence[float]] = None,
            depth_m: Optional[float] = None, attitude_deg: Optional[Sequence[float]] = None,
            quaternion: Optional[Sequence[float]] = None, velocity_mps: Optional[Sequence[float]] = None,
            altitude_m: Optional[float] = None, speed_bound_mps: Optional[Sequence[float]] = None,
            no_speed_bound: Optional[Literal["messages", "rate", "parameters", "frame", "motors", "sticks", "pulses",
            "clock", "vehicle"]] = None, push_n: Optional[Sequence[float]] = None) -> None:
        """Where the vehicle is.
        t_unix: Unix time of the measurement; in s.
        position_m: north, east, down; in m.
        depth_m: below the surface; in m.
        attitude_deg: roll, pitch, yaw; in degrees.
        quaternion: w, x, y, z, body to north-east-down, instead.
        velocity_mps: north, east, down; in m/s.
        altitude_m: above the bottom, straight down; in m.
        speed_bound_mps: the most that it has gone through the water since the bound before, level and up or down; in m/s.
        no_speed_bound: why there is none from now on.
        push_n: which way its thrusters push it, forward and to the right; in N.
        """
        await self._ask("pose", {"t_unix": t_unix, "position_m": position_m, "depth_m": depth_m,
            "attitude_deg": attitude_deg, "quaternion": quaternion, "velocity_mps": velocity_mps,
            "altitude_m": altitude_m, "speed_bound_mps": speed_bound_mps, "no_speed_bound": no_speed_bound,
            "push_n": push_n})

    async def pose_withdraw(self) -> None:
        """Go on without a pose, as if none had ever been given."""
        await self._ask("pose_withdraw", {})

    async def status(self) -> results.StatusResult:
        """What the daemon and its sonars do."""
        return cast("results.StatusResult", await self._ask("status", {}))

    async def sensors(self) -> results.SensorsResult:
        """What every sonar is, where it sits and what it does."""
        return cast("results.SensorsResult", await self._ask("sensors", {}))

    async def stats(self) -> results.StatsResult:
        """Counters and latencies."""
        return cast("results.StatsResult", await self._ask("stats", {}))

    async def plan(self) -> results.PlanResult:
        """Which stages run, which are left out, why, and their memory."""
        return cast("results.PlanResult", await self._ask("plan", {}))

    async def version(self) -> results.VersionResult:
        """Versions of the daemon and of the protocol."""
        return cast("results.VersionResult", await self._ask("version", {}))

    async def image(self, *, sensor: Optional[str] = None, newer_s: Optional[float] = None) -> results.ImageResult:
        """The last turn of a sonar as a picture.
        sensor: name of the sonar.
        newer_s: leave out rows that were pinged longer ago; in s.
        """
        return cast("results.ImageResult", await self._ask("image", {"sensor": sensor, "newer_s": newer_s}))

    async def clusters(self, *, count: Optional[int] = None, grid: Optional[str] = None) -> results.ClustersResult:
        """What the obstacles form together.
        count: list at most so many, the nearest; 64 unless given.
        grid: name of the grid to ask.
        """
        return cast("results.ClustersResult", await self._ask("clusters", {"count": count, "grid": grid}))

    async def next_look(self, *, count: Optional[int] = None, elevation_deg: Optional[Sequence[float]] = None,
            apart_deg: Optional[float] = None, grid: Optional[str] = None) -> results.NextLookResult:
        """Which directions to look at next, and why.
        count: list at most so many directions; 8 unless given.
        elevation_deg: lowest and highest; in degrees; [-5, 5] unless given.
        apart_deg: leave out what is nearer to a better direction; in degrees; 10 unless given.
        grid: name of the grid to ask.
        """
        return cast("results.NextLookResult", await self._ask("next_look", {"count": count,
            "elevation_deg": elevation_deg, "apart_deg": apart_deg, "grid": grid}))

    async def grid_lock(self, azimuth_deg: float, *, elevation_deg: Optional[float] = None,
            half_angle_deg: Optional[float] = None, from_m: Optional[float] = None, to_m: Optional[float] = None,
            locked: Optional[bool] = None, grid: Optional[str] = None) -> results.GridLockResult:
        """Lock cells, which then neither change nor fade, or unlock them.
        azimuth_deg: axis of a cone, in the axes of the grid; in degrees.
        elevation_deg: upward; in degrees; 0 unless given.
        half_angle_deg: half the opening of the cone; in degrees; 5 unless given.
        from_m: cells not nearer than this; in m; 0 unless given.
        to_m: cells not farther than this; in m; 10000 unless given.
        locked: false unlocks; true unless given.
        grid: name of the grid to ask.
        """
        return cast("results.GridLockResult", await self._ask("grid_lock", {"azimuth_deg": azimuth_deg,
            "elevation_deg": elevation_deg, "half_angle_deg": half_angle_deg, "from_m": from_m, "to_m": to_m,
            "locked": locked, "grid": grid}))

    async def background(self, *, sensor: Optional[str] = None, picture: Optional[Literal["no",
            "yes"]] = None) -> results.BackgroundResult:
        """What a sonar hears of the vehicle itself.
        sensor: name of the sonar.
        picture: also the rows of the template; "no" unless given.
        """
        return cast("results.BackgroundResult", await self._ask("background", {"sensor": sensor, "picture": picture}))

    async def background_learn(self, *, sensor: Optional[str] = None, pings: Optional[int] = None,
            motion: Optional[Literal["wanted", "any"]] = None) -> results.BackgroundResult:
        """Learn a background template.
        sensor: name of the sonar.
        pings: pings of each direction; 15 unless given.
        motion: take pings only as the vehicle moves, or any; "wanted" unless given.
        """
        return cast("results.BackgroundResult", await self._ask("background_learn", {"sensor": sensor, "pings": pings,
            "motion": motion}))

    async def background_stop(self, *, sensor: Optional[str] = None, use: Optional[Literal["no",
            "yes"]] = None) -> results.BackgroundResult:
        """End learning.
        sensor: name of the sonar.
        use: make the template of what there is; "no" unless given.
        """
        return cast("results.BackgroundResult", await self._ask("background_stop", {"sensor": sensor, "use": use}))

    async def background_save(self, *, sensor: Optional[str] = None) -> results.BackgroundResult:
        """Save the template in force to the configured file.
        sensor: name of the sonar.
        """
        return cast("results.BackgroundResult", await self._ask("background_save", {"sensor": sensor}))

    async def background_load(self, *, sensor: Optional[str] = None) -> results.BackgroundResult:
        """Load the template from the configured file.
        sensor: name of the sonar.
        """
        return cast("results.BackgroundResult", await self._ask("background_load", {"sensor": sensor}))

    async def background_forget(self, *, sensor: Optional[str] = None) -> results.BackgroundResult:
        """Take the template out of force.
        sensor: name of the sonar.
        """
        return cast("results.BackgroundResult", await self._ask("background_forget", {"sensor": sensor}))

    async def point(self, position_m: Sequence[float], *, frame: Optional[Literal["ned",
            "body"]] = None) -> results.PointResult:
        """Is this place free?
        position_m: the place; in m.
        frame: north, east, down from the origin of the poses, or forward, right, down from the vehicle; "ned" unless given.
        """
        return cast("results.PointResult", await self._ask("point", {"position_m": position_m, "frame": frame}))

    async def box(self, from_m: Sequence[float], to_m: Sequence[float]) -> results.BoxResult:
        """Is all of the box between two places free?
        from_m: one corner: north, east, down; in m.
        to_m: the corner opposite; in m.
        """
        return cast("results.BoxResult", await self._ask("box", {"from_m": from_m, "to_m": to_m}))

    async def path(self, points_m: Sequence[Sequence[float]], radius_m: float, *, frame: Optional[Literal["ned",
            "body"]] = None) -> results.PathResult:
        """May a body pass along these places?
        points_m: way points; in m.
        radius_m: of the body that passes; in m.
        frame: north, east, down from the origin of the poses, or forward, right, down from the vehicle; "ned" unless given.
        """
        return cast("results.PathResult", await self._ask("path", {"points_m": points_m, "radius_m": radius_m,
            "frame": frame}))

    async def map(self) -> results.MapResult:
        """The voxel map: its state and its jobs."""
        return cast("results.MapResult", await self._ask("map", {}))

    async def map_slice(self, *, middle_m: Optional[Sequence[float]] = None, depth_m: Optional[float] = None,
            size_m: Optional[float] = None, cells: Optional[int] = None) -> results.MapSliceResult:
        """A level picture of the map.
        middle_m: north, east of its middle; in m.
        depth_m: below the surface; in m.
        size_m: side of the picture; in m; 40 unless given.
        cells: along a side; 160 unless given.
        """
        return cast("results.MapSliceResult", await self._ask("map_slice", {"middle_m": middle_m, "depth_m": depth_m,
            "size_m": size_m, "cells": cells}))

    async def map_new(self) -> results.MapResult:
        """Begin a new submap with the next ping."""
        return cast("results.MapResult", await self._ask("map_new", {}))

    async def map_forget(self) -> results.MapResult:
        """Forget the whole map."""
        return cast("results.MapResult", await self._ask("map_forget", {}))

    async def map_submaps(self) -> results.MapSubmapsResult:
        """What the map is made of."""
        return cast("results.MapSubmapsResult", await self._ask("map_submaps", {}))

    async def map_move(self, id: int, position_m: Sequence[float], *, attitude_deg: Optional[Sequence[float]] = None,
            quaternion: Optional[Sequence[float]] = None) -> results.Submap:
        """Move a submap to where it really lies.
        id: of the submap.
        position_m: north, east, down of its base; in m.
        attitude_deg: roll, pitch, yaw; in degrees.
        quaternion: w, x, y, z, body to north-east-down, instead.
        """
        return cast("results.Submap", await self._ask("map_move", {"id": id, "position_m": position_m,
            "attitude_deg": attitude_deg, "quaternion": quaternion}))

    async def surface(self, *, cursor: Optional[Optional[str]] = None,
            count: Optional[int] = None) -> results.SurfaceResult:
        """Where the free water of the map ends, page by page.
        cursor: of the page before.
        count: points of a page; 256 unless given.
        """
        return cast("results.SurfaceResult", await self._ask("surface", {"cursor": cursor, "count": count}))

    async def map_save(self, name: str) -> results.MapResult:
        """Save the map.
        name: of the file, without its ending: 1 to 64 letters, digits, - and _.
        """
        return cast("results.MapResult", await self._ask("map_save", {"name": name}))

    async def map_load(self, name: str) -> results.MapResult:
        """Put a saved map in place of this one.
        name: of the file, without its ending: 1 to 64 letters, digits, - and _.
        """
        return cast("results.MapResult", await self._ask("map_load", {"name": name}))

    async def map_export(self, name: str, *, format: Optional[Literal["ply", "mcap",
            "bt"]] = None) -> results.MapResult:
        """Write the surface or the voxels for other programs.
        name: of the file, without its ending: 1 to 64 letters, digits, - and _.
        format: of the file; "ply" unless given.
        """
        return cast("results.MapResult", await self._ask("map_export", {"name": name, "format": format}))

    async def grid_list(self) -> results.GridListResult:
        """The spherical grids."""
        return cast("results.GridListResult", await self._ask("grid_list", {}))

    async def grid_cells(self, *, cursor: Optional[Optional[str]] = None, count: Optional[int] = None,
            grid: Optional[str] = None) -> results.GridCellsResult:
        """Every cell of a spherical grid, page by page.
        cursor: of the page before.
        count: cells of a page, at most; 256 unless given.
        grid: name of the grid to ask.
        """
        return cast("results.GridCellsResult", await self._ask("grid_cells", {"cursor": cursor, "count": count,
            "grid": grid}))

    async def record_start(self) -> results.RecordState:
        """Begin to record, in a new file."""
        return cast("results.RecordState", await self._ask("record_start", {}))

    async def record_stop(self) -> results.RecordState:
        """Complete the recording's file, and record nothing."""
        return cast("results.RecordState", await self._ask("record_stop", {}))

    async def reload(self) -> results.ReloadResult:
        """Read the configuration again."""
        return cast("results.ReloadResult", await self._ask("reload", {}))

    async def reload_check(self, *, file: Optional[str] = None, text: Optional[str] = None) -> results.ReloadResult:
        """What a reload would say; nothing changes.
        file: of the configuration's folder, as an absolute path without links, there or not.
        text: what that file holds instead.
        """
        return cast("results.ReloadResult", await self._ask("reload_check", {"file": file, "text": text}))

    async def replay(self, *, pause: Optional[Literal["no", "yes"]] = None, speed: Optional[float] = None,
            to_s: Optional[float] = None) -> results.ReplayState:
        """Pause a capture that is played, or jump in it.
        pause: yes: the clock stands.
        speed: 1: as recorded; 0: as fast as it goes.
        to_s: jump to so long after the first message; in s.
        """
        return cast("results.ReplayState", await self._ask("replay", {"pause": pause, "speed": speed, "to_s": to_s}))
