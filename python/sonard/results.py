# SPDX-License-Identifier: MIT
# Written by python/generate_methods from the schema of the protocol.
"""What the methods of the daemon return: dicts, as they come."""
from __future__ import annotations

from typing import Any, Dict, List, Literal, Optional, TypedDict, Union


Reference = TypedDict(
    "Reference",
    {
        "target": "str",
        "bottom_db": "Optional[float]",
        "level_db": "float",
        "counts": "int",
        "from": "Literal[\"prior\", \"its echoes\"]",
        "noisy": "bool",
    },
)


NamedReference = TypedDict(
    "NamedReference",
    {
        "sensor": "str",
        "target": "str",
        "bottom_db": "Optional[float]",
        "level_db": "float",
        "counts": "int",
        "from": "Literal[\"prior\", \"its echoes\"]",
        "noisy": "bool",
    },
)


class Cleanup(TypedDict):
    stages: List[str]
    delay_pings: int
    held: int
    rows: int
    restarts: int
    not_cleaned: int
    last_turn_otsu: Optional[int]
    last_turn_lowest_class: Optional[int]
    order: Literal["safe", "paper"]


class _Clock(TypedDict):
    used: bool
    restarts: int


class Clock(_Clock, total=False):
    offset_s: float
    drift_ppm: float
    jitter_s: float


class Bus(TypedDict):
    state: Literal["down", "up", "warning", "passive", "off"]
    tx_errors: int
    rx_errors: int
    error_frames: int
    bus_offs: int
    restarts: int
    controller_overflows: int
    transfer_errors: int
    not_sent: int


class _Sensor(TypedDict):
    name: str
    device: str
    port: str
    state: Literal["closed", "asking who is there", "setting up", "running", "silent", "no port"]
    what: str
    range_m: float
    pings: int
    last_ping_age_s: Optional[float]
    frames: int
    garbage_bytes: int
    cut_bytes: int
    bad_checksum: int
    bad_frame: int
    lost_frames: int
    nacks: int
    timeouts: int
    restarts: int
    taken_over: int
    reconnects: int
    undated_pings: int
    tap_lost_bytes: int
    tap_refused_bytes: int
    port_lost: int
    port_refused: int
    port_strangers: int
    bytes_in: int
    bytes_out: int
    dropped: int
    background: str
    cleanup: Optional[Cleanup]
    own_bearings: int
    amplitude_doubt: Optional[str]
    hearing_doubt: Optional[str]
    detects: Optional[Reference]
    other_settings: Optional[str]
    contested: bool


class Sensor(_Sensor, total=False):
    port_error: str
    clock: Clock
    bus: Bus


class Grid(TypedDict):
    name: str
    range_m: float
    angular_step_deg: float
    layer_m: float
    sensor_model: Literal["opening", "gauss", "midpoint"]
    level: bool
    axes: Literal["ned", "course"]
    clear_for_s: float
    bytes: int
    cells: int
    directions: int
    pinged: int
    cells_lost: int
    out_of_range: int


class ExplainedCell(TypedDict):
    azimuth_deg: float
    elevation_deg: float
    near_m: float
    range_m: float
    confidence: float
    echoes: int
    first_echo_age_s: Optional[float]
    last_echo_age_s: Optional[float]
    misses: int
    turn: Literal["appeared", "updated", "missed", "not observed"]
    locked: bool
    sensor: str
    last_ping: int


class GridCell(TypedDict):
    azimuth_deg: float
    elevation_deg: float
    from_m: float
    to_m: float
    near_m: float
    position_m: List[float]
    position_sd_m: float
    confidence: float
    blocks: bool
    echoes: int
    first_echo_age_s: Optional[float]
    last_echo_age_s: Optional[float]
    misses: int
    turn: Literal["appeared", "updated", "missed", "not observed"]
    locked: bool
    sensor: str


class Uncertainty(TypedDict):
    moved_m: float
    turned_deg: float


class ExplainedCells(TypedDict):
    all: int
    nearest: List[ExplainedCell]


class GoneCell(TypedDict):
    azimuth_deg: float
    elevation_deg: float
    range_m: float
    echoes: int
    first_echo_age_s: Optional[float]
    last_echo_age_s: Optional[float]
    misses: int
    sensor: str
    last_ping: int


class GoneCells(TypedDict):
    all: int
    newest: List[GoneCell]


class RecordedWater(TypedDict):
    free_from_m: float
    free_to_m: float
    records: int
    oldest_age_s: Optional[float]


class ExplainedPing(TypedDict):
    sensor: str
    number: int
    t_unix: float
    age_s: Optional[float]
    bearing_deg: float
    azimuth_deg: float
    elevation_deg: float
    says: Literal["echo", "free", "nothing", "own"]
    range_m: Optional[float]
    bin: Optional[int]
    confidence: Optional[float]
    blind_to_m: float
    free_to_m: float


class ExplainedPings(TypedDict):
    echo: int
    free: int
    nothing: int
    own: int
    back_to_s: Optional[float]
    newest: List[ExplainedPing]


class Sector(TypedDict):
    azimuth_deg: float
    width_deg: float
    state: Literal["blocked", "clear", "unknown"]
    range_m: Optional[float]
    free_to_m: float
    blind_to_m: float
    age_s: Optional[float]


class PoseLimits(TypedDict):
    attitude: Optional[float]
    position: Optional[float]
    depth: Optional[float]
    velocity: Optional[float]
    altitude: Optional[float]


class SpeedBoundState(TypedDict):
    state: Literal["none", "used", "not used", "lost"]
    level_mps: Optional[float]
    vertical_mps: Optional[float]
    why: str


class PoseState(TypedDict):
    age_s: Optional[float]
    has: List[Literal["attitude", "position", "depth", "velocity", "altitude"]]
    max_age_s: PoseLimits
    attitude_deg: Optional[List[float]]
    position_m: Optional[List[float]]
    altitude_m: Optional[float]
    count: int
    refused: int
    jumps: int
    withdrawn: int
    missing: str
    drift: str
    speed_bound: SpeedBoundState
    doubt: str


class Latency(TypedDict):
    p50: float
    p99: float
    p999: float
    max: float


class PipelineState(TypedDict):
    threads: int
    queue: int
    pings: int
    waiting: int
    dropped: int
    records_left_out: int
    latency_us: Optional[Latency]


class GridCounters(TypedDict):
    cells: int
    directions: int
    pinged: int
    cells_lost: int
    out_of_range: int
    no_attitude: int
    recentred: int
    turned: int


class ServerState(TypedDict):
    clients_now: int
    clients_total: int
    clients_refused: int
    clients_cut: int
    requests: int
    errors: int
    notifications_sent: int
    notifications_skipped: int


class RecordState(TypedDict):
    recording: bool
    paused: bool
    path: str
    parts: int
    messages: int
    recording_messages: int
    recording_age_s: Optional[float]
    lost_messages: int
    overflows: int
    waiting_bytes: int
    errors: int
    error: str


class DepthState(TypedDict):
    source: str
    state: str
    depth_m: Optional[float]
    age_s: Optional[float]
    error: str
    oddities: str
    samples: int
    implausible: int
    timeouts: int
    exceptions: int
    bad_answers: int
    out_of_step: int
    no_number: int
    reconnects: int
    dropped: int


class NmeaState(TypedDict):
    port: str
    state: Literal["open", "no port"]
    age_s: Optional[float]
    error: str
    unused: str
    sentences: int
    values: int
    odd: int
    not_available: int
    other: int
    bad_checksum: int
    no_checksum: int
    bad_sentence: int
    overlong: int
    garbage_bytes: int
    no_variation: int
    excluded: int
    heading_not_used: int
    late_bytes: int
    bytes_in: int
    strangers: int
    reconnects: int


class ReplayState(TypedDict):
    length_s: Optional[float]
    position_s: float
    speed: float
    paused: bool
    jumping: bool


class LeakState(TypedDict):
    line: str
    state: Literal["unknown", "dry", "wet"]
    age_s: Optional[float]
    alarms: int
    error: str


class GpioPower(TypedDict):
    sensor: str
    line: str
    state: Literal["unknown", "off", "on"]
    cycles: int
    error: str


class GpioTrigger(TypedDict):
    sensor: str
    line: str
    edges: int
    used: int
    not_used: int
    error: str


class GpioState(TypedDict):
    library: str
    power: List[GpioPower]
    trigger: List[GpioTrigger]


class Tuning(TypedDict):
    range_m: float
    range_least_m: float
    range_most_m: float
    gain: Optional[int]
    gain_most: int
    mode: Optional[Literal["auto", "transmit", "request"]]


class _PlacedSensor(TypedDict):
    name: str
    device: str
    port: str
    state: Literal["closed", "asking who is there", "setting up", "running", "silent", "no port"]
    what: str
    range_m: float
    pings: int
    last_ping_age_s: Optional[float]
    frames: int
    garbage_bytes: int
    cut_bytes: int
    bad_checksum: int
    bad_frame: int
    lost_frames: int
    nacks: int
    timeouts: int
    restarts: int
    taken_over: int
    reconnects: int
    undated_pings: int
    tap_lost_bytes: int
    tap_refused_bytes: int
    port_lost: int
    port_refused: int
    port_strangers: int
    bytes_in: int
    bytes_out: int
    dropped: int
    background: str
    cleanup: Optional[Cleanup]
    own_bearings: int
    amplitude_doubt: Optional[str]
    hearing_doubt: Optional[str]
    detects: Optional[Reference]
    other_settings: Optional[str]
    contested: bool
    mount_m: List[float]
    rotation_deg: List[float]
    sector_deg: List[float]
    heard: bool
    tuning: Optional[Tuning]


class PlacedSensor(_PlacedSensor, total=False):
    port_error: str
    clock: Clock
    bus: Bus


class Sample(TypedDict):
    labels: Dict[str, str]
    value: float


class Histogram(TypedDict):
    labels: Dict[str, str]
    count: int
    sum_s: float
    p50_us: float
    p99_us: float
    p999_us: float
    max_us: float
    buckets: List[List[float]]


class Metric(TypedDict):
    name: str
    type: Literal["counter", "gauge", "histogram"]
    help: str
    samples: List[Union[Sample, Histogram]]


Stage = TypedDict(
    "Stage",
    {
        "name": "str",
        "of": "Optional[str]",
        "in": "bool",
        "proof": "Optional[Literal[\"identical\", \"bounded\"]]",
        "why": "str",
        "bytes": "Optional[int]",
    },
)


class RowEcho(TypedDict):
    range_m: float
    confidence: float
    marks: List[Literal["burst", "ghost", "faint", "alone", "other", "own"]]


class ImageRow(TypedDict):
    azimuth_deg: float
    width_deg: float
    r0_m: float
    r1_m: float
    age_s: Optional[float]
    samples: str
    echo_m: Optional[float]
    near_m: Optional[float]
    echoes: List[RowEcho]
    blind_m: float
    state: Literal["echo", "silent", "blind"]


class ClusterTurn(TypedDict):
    appeared: int
    updated: int
    missed: int


class ClusterNearest(TypedDict):
    azimuth_deg: float
    elevation_deg: float


class Cluster(TypedDict):
    label: int
    cells: int
    seeds: int
    echoes: int
    turn: ClusterTurn
    locked: int
    from_deg: float
    width_deg: float
    elevation_deg: List[float]
    near_m: float
    far_m: float
    nearest: ClusterNearest
    centre_m: List[float]
    confidence: float
    first_echo_age_s: Optional[float]
    last_echo_age_s: Optional[float]
    label_age_s: Optional[float]
    approach_mps: float
    growth_directions_ps: float
    ghost_of: Optional[int]


class Wall(TypedDict):
    normal_deg: float
    distance_m: float
    from_m: float
    to_m: float
    rms_m: float
    points: int
    constant_depth: bool


class Corner(TypedDict):
    walls: List[int]
    place_m: List[float]


class Arc(TypedDict):
    centre_m: List[float]
    radius_m: float
    rms_m: float
    points: int


class DepthRegion(TypedDict):
    from_deg: float
    width_deg: float
    least_m: float
    most_m: float
    bearings: int
    wall: Optional[int]


class GoneCluster(TypedDict):
    label: int
    why: Literal["seen through", "behind something nearer", "out of reach", "not observed for long"]
    age_s: Optional[float]
    azimuth_deg: float
    elevation_deg: float
    range_m: float
    cells: int
    last_echo_age_s: Optional[float]


class Look(TypedDict):
    azimuth_deg: float
    elevation_deg: float
    score: float
    why: Literal["never observed", "not observed for long", "obstacle approaching", "obstacle growing", "edge of an obstacle", "obstacle vanished"]
    age_s: Optional[float]


class Template(TypedDict):
    rows: float
    rows_learnt: int
    bins: int
    r0_m: float
    r1_m: float
    mask: float
    blind_cells: int
    clusters: float
    clusters_kept: int
    fits: str
    saved: bool


class Learning(TypedDict):
    pings: int
    progress: float
    rows_seen: int
    rows_full: int
    least: int
    taken: int
    unmoved: int
    no_pose: int
    other_bins: int
    motion: str


class TemplateRow(TypedDict):
    azimuth_deg: float
    width_deg: float
    r0_m: float
    r1_m: float
    pings: int
    samples: str
    blind: List[List[float]]


class FirstVoxel(TypedDict):
    state: Literal["occupied", "unknown"]
    position_m: List[float]


class FirstAlong(TypedDict):
    state: Literal["occupied", "unknown"]
    position_m: List[float]
    along_m: float


class SurfacePoint(TypedDict):
    position_m: List[float]
    normal: List[float]
    tag: Literal["echo", "limit"]


class Job(TypedDict):
    what: Literal["save", "load", "export"]
    state: Literal["running", "done", "failed"]
    path: str
    message: str


class KeptJob(TypedDict):
    what: Literal["save", "load"]
    state: Literal["running", "done", "failed"]
    path: str
    message: str


class Submap(TypedDict):
    id: int
    current: bool
    moved: bool
    pings: int
    begin_age_s: Optional[float]
    position_m: List[float]
    quaternion: List[float]


class BlockedResult(TypedDict):
    state: Literal["blocked", "clear", "unknown"]
    range_m: Optional[float]
    range_sd_m: Optional[float]
    confidence: float
    free_to_m: float
    blind_to_m: float
    age_s: Optional[float]
    reason: str
    target: str
    bottom_db: Optional[float]


class ExplainResult(TypedDict):
    frame: Literal["body", "ned"]
    answer: BlockedResult
    uncertain: Uncertainty
    cells: ExplainedCells
    gone: GoneCells
    water: Optional[RecordedWater]
    detects: List[NamedReference]
    pings: ExplainedPings


class SectorsResult(TypedDict):
    frame: Literal["body", "ned"]
    t_unix: float
    pose_age_s: Optional[float]
    near_m: float
    distance_m: float
    target: str
    bottom_db: Optional[float]
    why_none_clear: Optional[str]
    sectors: List[Sector]


class NearestResult(TypedDict):
    frame: Literal["body", "ned"]
    state: Literal["blocked", "clear", "unknown"]
    azimuth_deg: Optional[float]
    elevation_deg: Optional[float]
    range_m: Optional[float]
    range_sd_m: Optional[float]
    confidence: Optional[float]
    age_s: Optional[float]
    unknown_share: float
    reason: str
    target: str
    bottom_db: Optional[float]


class TimeToCollisionResult(TypedDict):
    state: Literal["blocked", "clear", "unknown"]
    time_s: Optional[float]
    time_sd_s: Optional[float]
    distance_m: Optional[float]
    confidence: Optional[float]
    unknown_after_s: Optional[float]
    speed_mps: float
    ahead_s: float
    age_s: Optional[float]
    reason: str
    target: str
    bottom_db: Optional[float]


class LimitResult(TypedDict):
    velocity_mps: List[float]
    speed_mps: float
    asked_mps: float
    limited_by: Literal["nothing", "blocked", "unknown"]
    azimuth_deg: Optional[float]
    elevation_deg: Optional[float]
    stop_m: float
    uncertain_m: float
    blocked_m: Optional[float]
    free_m: float
    age_s: Optional[float]
    reason: str
    remedy: str
    target: str
    bottom_db: Optional[float]


class PoseResult(TypedDict):
    taken: bool


class PoseWithdrawResult(TypedDict):
    withdrawn: bool


class StatusResult(TypedDict):
    version: str
    uptime_s: float
    t_unix: float
    mode: Literal["live", "replay", "replay, ended"]
    config: str
    data: str
    misfits: List[str]
    sensors: List[Sensor]
    pose: PoseState
    pipeline: PipelineState
    grid: GridCounters
    server: ServerState
    record: Optional[RecordState]
    depth: Optional[DepthState]
    nmea: Optional[NmeaState]
    leak: Optional[LeakState]
    gpio: GpioState
    grids: List[Grid]
    replay: Optional[ReplayState]


class SensorsResult(TypedDict):
    sensors: List[PlacedSensor]


class StatsResult(TypedDict):
    version: str
    metrics: List[Metric]


class PlanResult(TypedDict):
    stages: List[Stage]
    bytes: int


class VersionResult(TypedDict):
    version: str
    protocol: int


class ImageResult(TypedDict):
    sensor: str
    frame: Literal["body"]
    t_unix: float
    rows: List[ImageRow]


class ClustersResult(TypedDict):
    frame: Literal["body", "ned"]
    pose: Literal["not needed", "fresh", "old"]
    all: int
    clusters: List[Cluster]
    walls: List[Wall]
    corners: List[Corner]
    arcs: List[Arc]
    regions: List[DepthRegion]
    gone: List[GoneCluster]


class NextLookResult(TypedDict):
    frame: Literal["body", "ned"]
    directions: List[Look]


class GridLockResult(TypedDict):
    frame: Literal["body", "ned"]
    cells: int
    locked: bool


class _BackgroundResult(TypedDict):
    sensor: str
    state: str
    file: Optional[str]
    template: Optional[Template]
    learning: Optional[Learning]
    happened: str


class BackgroundResult(_BackgroundResult, total=False):
    rows: List[TemplateRow]


class PointResult(TypedDict):
    first: Optional[FirstVoxel]
    age_s: Optional[float]
    state: Literal["free", "occupied", "unknown"]
    unknown_share: float
    reason: str
    target: str
    bottom_db: Optional[float]


class BoxResult(TypedDict):
    first: Optional[FirstVoxel]
    state: Literal["free", "occupied", "unknown"]
    unknown_share: float
    reason: str
    target: str
    bottom_db: Optional[float]


class PathResult(TypedDict):
    first: Optional[FirstAlong]
    state: Literal["free", "occupied", "unknown"]
    unknown_share: float
    reason: str
    target: str
    bottom_db: Optional[float]


class _MapResult(TypedDict):
    state: str


class MapResult(_MapResult, total=False):
    voxel_m: float
    submaps: int
    begun: int
    used_bytes: int
    memory_bytes: int
    pings: int
    beams: int
    not_entered: int
    clipped: int
    starved: int
    dropped: int
    saved: int
    save_errors: int
    directory: Optional[str]
    job: Optional[Job]
    kept: Optional[KeptJob]


class MapSliceResult(TypedDict):
    depth_m: float
    north_m: float
    east_m: float
    step_m: float
    vehicle_m: Optional[List[float]]
    heading_deg: Optional[float]
    rows: List[str]


class MapSubmapsResult(TypedDict):
    submaps: List[Submap]


class SurfaceResult(TypedDict):
    voxel_m: float
    points: List[SurfacePoint]
    cursor: Optional[str]
    changed: bool


class GridListResult(TypedDict):
    grids: List[Grid]
    bytes: int
    memory: int


class GridCellsResult(TypedDict):
    frame: Literal["body", "ned"]
    t_unix: float
    cells: List[GridCell]
    cursor: Optional[str]
    changed: bool


class ReloadResult(TypedDict):
    applied: List[str]
    needs_restart: List[str]


class WatchResult(TypedDict):
    watch: int


class UnwatchResult(TypedDict):
    watch: int
