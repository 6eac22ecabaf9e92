"""A robot that runs while one watches: choose task and policy, change gait and friction, move obstacles."""

from __future__ import annotations

import threading
import time
from collections import deque
from dataclasses import replace
from typing import Any

import gymnasium as gym
import numpy as np

from snake_env.config import Start
from snake_env.errors import ConfigError
from snake_env.evaluation import seeds, tasks
from snake_env.evaluation.tasks import BenchmarkTask, acting_in
from snake_env.obstacles import HeightField
from snake_env.palette import PEG_HEIGHT
from snake_env.policies.gaits import DEGREE, GaitParameters, GaitPolicy
from snake_env.policies.interface import acting
from snake_env.policies.loading import GAIT, SCRIPTED
from snake_env.policies.shipped import NAMES
from snake_env.registration import TASKS
from snake_env.state import State
from snake_env.viewer.camera import Follower, look_at
from snake_env.viewer.controls import Control, Slider, checkbox, choice, count, place
from snake_env.viewer.drawing import Drawing
from snake_env.viewer.frames import Frames
from snake_env.viewer.player import SPEEDS, close, server
from snake_env.viewer.plots import Plots
from snake_env.viewer.pull import Pull

TASK = "field-medium"
"""Without any other choice."""
MEMORY = 200
"""Control instants in the plots."""
KEYS = {
    "arrowleft": ("gamma", -2.0),
    "arrowright": ("gamma", 2.0),
    "arrowup": ("omega", 10.0),
    "arrowdown": ("omega", -10.0),
}
"""Keys of the page: the slider of the gait that each moves, and by how much."""
PAUSE = 1.0
"""How long an episode that has ended is shown before the next one begins [s]."""
TOLD, PLOTTED = 4, 10
"""Control instants between two changes of the status line, and of the plots, which cost more than the robot."""
CLICKED = 0.15
"""Largest distance from a click to the middle of a link [m]."""


class Live:
    """A page with one running robot; the simulation is on a thread of its own until :meth:`stop`.

    Args:
        task: of the first episode.
        policy: name, or a policy of the user's own.
        host: interface that serves the page.
        port: of the page; the next free one if it is taken.

    Raises:
        ConfigError: the policy does not fit the task.
    """

    def __init__(self, task: BenchmarkTask, policy: Any = GAIT, host: str = "127.0.0.1", port: int = 8080) -> None:
        self._tasks = tasks.load() | {task.name: task}
        self._env: Any = None
        self._shown: dict[Control, Any] = {}
        """Task, policy, scene and friction of the running episode."""
        self._puts_back = self._ended = False
        self._episodes = self._reached = 0
        self._waits_until = 0.0
        self._outcome = self._refusal = ""
        self._lock = threading.RLock()
        self._changed: dict[str, Any] = {}
        """Scene and start of episodes after an obstacle was moved."""
        self._states: deque[State] = deque(maxlen=MEMORY)
        self.server = server(host, port)
        self._controls(task, policy)
        try:
            self._begin()
        except Exception:
            close(self.server)
            raise
        look_at(self.server, self._frames())
        self._running = threading.Event()
        self._running.set()
        self._thread = threading.Thread(target=self._run, daemon=True)
        self._thread.start()

    @property
    def url(self) -> str:
        """Of the page."""
        return f"http://{self.server.get_host()}:{self.server.get_port()}"

    @property
    def state(self) -> State:
        """The present state of the robot."""
        with self._lock:  # there is none while an episode begins
            return self._states[-1]

    def stop(self) -> None:
        """Ends the simulation and closes the page."""
        self._running.clear()
        self._thread.join()
        close(self.server)
        self._env.close()

    def wait(self) -> None:
        """Returns when the process is interrupted."""
        while self._running.is_set():
            time.sleep(0.2)

    def _controls(self, task: BenchmarkTask, policy: Any) -> None:
        gui = self.server.gui
        self.status = gui.add_markdown("")
        self.playing = checkbox(gui, "playing", True)
        self.speed = Slider(gui, "speed", *SPEEDS)
        self.camera = Follower(self.server, initial=True)
        self.goes_on = checkbox(gui, "next scene after an episode", True)
        self.task = choice(gui, "task", tuple(self._tasks), task.name)
        own = policy if isinstance(policy, str) else policy.name
        self._actors = {name: name for name in (GAIT, *SCRIPTED, *NAMES)} | {own: policy}
        self.policy = choice(gui, "policy", tuple(self._actors), own)
        self.scene = count(gui, "test scene", len(seeds.HELD_OUT) - 1)
        self.own_friction = checkbox(gui, "own friction", False)
        self.friction = Slider(gui, "friction", 0.05, 1.0, 0.01, 0.2)
        self.restart = gui.add_button("restart")
        with gui.add_folder("gait (policy: gait)"):
            self.amplitude = Slider(gui, "amplitude [deg]", 5.0, 65.0, 1.0, 40.0)
            self.omega = Slider(gui, "frequency [deg/s]", -40.0, 200.0, 1.0, 80.0)
            self.beta = Slider(gui, "phase shift [deg]", -65.0, -15.0, 1.0, -50.0)
            self.gamma = Slider(gui, "offset [deg]", -25.0, 25.0, 0.5, 0.0)
        with gui.add_folder("obstacle"):
            self.obstacle = count(gui, "number", hint="0: none; click one in the scene, then drag its handle")
        with gui.add_folder("push"):
            self.link = count(gui, "link", hint="0: none; click one, drag its handle, and a spring pulls it")
        self.note = gui.add_markdown("")
        self._plots = Plots(gui)
        self._handle: Any = None
        self._pull: Pull | None = None
        self._choices = (self.task, self.policy, self.scene, self.own_friction, self.friction)
        for control in self._choices:
            control.on_update(lambda: self._again(forget=True))
        self.restart.on_click(lambda _: self._again(forget=False))
        self._sliders = {"amplitude": self.amplitude, "omega": self.omega, "beta": self.beta, "gamma": self.gamma}
        for slider in self._sliders.values():
            slider.on_update(self._steer)
        for key, (name, change) in KEYS.items():
            self._key(key, name, change)
        self.obstacle.on_update(self._grip)
        self.link.on_update(self._take_hold)

    def _key(self, key: Any, name: str, change: float) -> None:
        """Lets a key of the page change a slider of the gait."""
        slider = self._sliders[name]
        command = self.server.gui.add_command(f"{name} {change:+g}", hotkey=key)
        command.on_trigger(lambda _: self.drive(slider, change))

    def drive(self, slider: Slider, change: float) -> None:
        """Moves a slider of the gait, as far as it goes."""
        slider.value = min(slider.max, max(slider.min, slider.value + change))

    def _again(self, forget: bool) -> None:
        """Begins anew; with the scene as it has been changed by hand, unless ``forget``."""
        with self._lock:
            if self._puts_back or (forget and self._chosen() == self._shown):
                return
            self._outcome = ""
            self._begin_with({} if forget else self._changed)

    def _begin_with(self, changed: dict[str, Any]) -> None:
        """Begins anew; where that is refused, the controls go back to the running episode."""
        before, self._changed = self._changed, changed
        try:
            self._begin()
        except Exception as error:  # whatever it is, the running episode goes on
            self._changed, self._puts_back = before, True
            for control, value in self._shown.items():
                control.value = value
            self._puts_back = False
            if self._ended:
                self._begin()
            self._tell(refusal=f"**{error}**")

    def _goes_on(self) -> None:
        """The next episode: in the next test scene, or in the same one with what has been changed by hand."""
        if self.goes_on.value and not self._changed:
            self._puts_back = True  # what the number of the scene would begin, begins below
            self.scene.value = (self.scene.value + 1) % len(seeds.HELD_OUT)
            self._puts_back = False
        self._begin_with(self._changed)

    def _chosen(self) -> dict[Control, Any]:
        return {control: control.value for control in self._choices}

    def _tell(self, refusal: str = "") -> None:
        """Writes the note: what the episode is, how the one before ended, and what is refused."""
        self._refusal = refusal
        parts = (self._outcome, self._tasks[self.task.value].about, refusal)
        self.note.content = "\n\n".join(filter(None, parts))

    def _begin(self) -> None:
        """A new episode of what the page says; nothing changes if that is refused."""
        shown = self._chosen()
        chosen = self._tasks[shown[self.task]]
        options = dict(chosen.options)
        if shown[self.own_friction]:
            options["friction"] = (shown[self.friction],) * 2
        chosen = BenchmarkTask(chosen.name, chosen.env_id, options, chosen.about)
        actor, _ = acting_in(self._actors[shown[self.policy]], chosen)
        options = acting(actor, options)
        env: Any = gym.make_vec(chosen.env_id, 1, num_threads=1, autoreset_mode="Disabled", **options)
        given = {"options": self._changed} if self._changed else {}
        observation, _ = env.reset(seed=[seeds.HELD_OUT[shown[self.scene]]], **given)
        actor.begin(env.unwrapped.layout, 1)
        if self._env is not None:
            self._env.close()
        self._env, self._actor, self._observation = env, actor, observation
        self._info: dict[str, Any] = {}
        is_new = any(self._shown.get(one) != shown[one] for one in (self.task, self.policy))
        if any(self._shown.get(one) != shown[one] for one in self._choices if one is not self.scene):
            self._episodes = self._reached = 0
        self._shown, self._ended = shown, False
        if is_new and self._driven() is not None:
            self._default = GaitParameters.default(env.unwrapped.layout["action"])
            for name, slider in self._sliders.items():
                slider.value = round(getattr(self._default, name) / DEGREE, 6)
        self._steer()
        self._states.clear()
        self._remember()
        self.server.scene.reset()
        self._handle = self._pull = None
        self._drawing = Drawing(self.server.scene, self._frames(), trail=False)
        for solid in self._drawing.solids:
            solid.on_click(self._clicked)
        self._grip()
        self._take_hold()
        self._tell(self._refusal)
        self._tell_status()

    def _clicked(self, event: Any) -> None:
        """Puts a handle on the obstacle or link that was clicked: the one nearest to where the ray meets its height."""
        origin, along = place(event.ray_origin), place(event.ray_direction)
        if origin is None or along is None or abs(along[2]) < 1e-6:
            return
        with self._lock:
            middles = self._frames().position[-1]
            links = np.linalg.norm(np.cross(middles - origin, along / np.linalg.norm(along)), axis=1)
            if links.min() < CLICKED and str(event.target.name).startswith("/links"):
                self.link.value = int(links.argmin()) + 1
                return
            obstacles = self._env.unwrapped.scene(0).obstacles
            hit = (origin - along * (origin[2] - 0.5 * PEG_HEIGHT) / along[2])[:2]
            if obstacles:
                far = [float(np.linalg.norm(_place(one) - hit)) for one in obstacles]
                self.obstacle.value = int(np.argmin(far)) + 1

    def _tell_status(self) -> None:
        """Time, distance, speed, residual, and how many episodes with these choices have reached the goal."""
        time_, distance = float(self.state.time), float(self.state.distance)
        speed = distance / time_ if time_ > 0.0 else 0.0
        parts = [f"**{time_:.1f} s**", f"{distance:.2f} m", f"{speed:.2f} m/s"]
        if self._info:
            parts.append(f"residual {float(self._info['residual'][0]):.0e} m/s")
        parts.append(f"goals {self._reached} of {self._episodes}")
        self.status.content = " · ".join(parts) + "  \narrows: 10 cm for 10 N"

    def _driven(self) -> GaitPolicy | None:
        """The gait of the sliders, where it is what acts."""
        return self._actor if self._shown[self.policy] == GAIT and isinstance(self._actor, GaitPolicy) else None

    def _steer(self) -> None:
        """Commands what the sliders say, where they drive the robot."""
        with self._lock:
            gait = self._driven()
            if gait is None:
                self._tell()
                return
            wave = {name: slider.value * DEGREE for name, slider in self._sliders.items()}
            try:
                gait.action = replace(self._default, **wave).action(self._env.unwrapped.layout["action"])
                self._tell()
            except ConfigError as error:
                self._tell(f"**{error}**")

    def _grip(self) -> None:
        """Puts a handle on the chosen obstacle; when it is let go, the episode begins anew with the obstacle there."""
        with self._lock:
            if self._handle is not None:
                self._handle.remove()
                self._handle = None
            scene, j = self._env.unwrapped.scene(0), self.obstacle.value
            if not 1 <= j <= len(scene.obstacles):
                return
            middle = _place(scene.obstacles[j - 1])
            handle = self.server.scene.add_transform_controls(
                "/handle", scale=0.3, position=(*middle, 0.1), active_axes=(True, True, False), disable_rotations=True
            )

            def let_go(event: Any) -> None:
                found = place(handle.position)
                if event.phase == "end" and found is not None:
                    dx, dy = found[:2] - middle
                    self.move(j, float(dx), float(dy))

            handle.on_update(let_go)
            self._handle = handle

    def _take_hold(self) -> None:
        """Puts a handle on the chosen link, by which it can be pulled."""
        with self._lock:
            if self._pull is not None:
                self._pull.remove()
                self._pull = None
            link = self.link.value
            if 1 <= link <= len(self.state.link_radius):
                self._pull = Pull(self.server.scene, link - 1, self.state)

    def move(self, j: int, dx: float, dy: float) -> None:
        """Shifts obstacle ``j`` (1-based) by (dx, dy) [m]; the robot begins anew where it is, at rest.

        Robots in 3D begin at their usual start.
        """
        with self._lock:
            try:
                scene = self._env.unwrapped.scene(0).moved(j, dx, dy)
            except ConfigError as error:
                self._tell(f"**{error}**")
                return
            self._begin_with({"scene": scene} | _start(self.state))

    def _remember(self) -> None:
        self._states.append(self._env.unwrapped.state().robot(0))

    def _frames(self) -> Frames:
        return Frames.of_states(list(self._states), self._env.unwrapped.scene(0))

    def _run(self) -> None:
        due, steps = time.perf_counter(), 0
        while self._running.is_set():
            if not self.playing.value:
                due = time.perf_counter()
                time.sleep(0.05)
                continue
            try:
                steps += 1
                due = max(due, time.perf_counter()) + self._moves_on(steps) / self.speed.value
            except Exception as error:  # the page stays, whatever becomes of the robot
                self.playing.value = False
                self._tell(f"**{error}**")
            time.sleep(max(0.0, due - time.perf_counter()))

    def _moves_on(self, steps: int) -> float:
        """The next control period, or the next episode; returns how long that takes [s]."""
        with self._lock:
            if self._ended:
                if time.perf_counter() >= self._waits_until:
                    self._goes_on()
                return 0.05
            self._step()
            if steps % TOLD == 0 or self._ended:
                self._tell_status()
            if steps % PLOTTED == 0 or self._ended:
                self._show_past()
            return float(self._env.unwrapped.control_period)

    def advance(self, steps: int) -> None:
        """Takes so many control periods at once while the page is paused, or fewer where the episode ends.

        Pages that open later look at the robot.
        """
        with self._lock:
            for _ in range(steps):
                if not self._ended:
                    self._step()
            self._show_past()
            self._tell_status()
            look_at(self.server, Frames.of_states([self.state], self._env.unwrapped.scene(0)))

    def _show_past(self) -> None:
        """Plots and trail."""
        frames = self._frames()
        self._plots.show(frames)
        if len(frames) > 1:
            self._drawing.trail(frames)

    def _step(self) -> None:
        """One control period; at its end the episode may have ended."""
        if self._pull is not None:
            impulse = self._pull.impulse(self.state, float(self._env.unwrapped.control_period))
            if impulse is not None:
                self._env.unwrapped.push(impulse)
        self._observation, _, terminated, truncated, self._info = self._env.step(self._actor(self._observation))
        self._remember()
        last = Frames.of_states([self.state], self._env.unwrapped.scene(0))
        self._drawing.show(last, 0)
        self.camera.show(last, 0)
        self._ended = bool(terminated[0] or truncated[0])
        if self._ended:
            self._episodes += 1
            self._reached += int(self._info["is_success"][0])
            reached = "goal reached" if self._info["is_success"][0] else "episode over"
            self._outcome = f"**{reached}** after {float(self.state.time):.2f} s"
            self._waits_until = time.perf_counter() + PAUSE
            self._tell(self._refusal)


def fitting(task: BenchmarkTask) -> str:
    """A shipped policy that moves in a task, else the gait of action zero."""
    options = TASKS[task.env_id] | dict(task.options)
    spatial = {"free": "spatial", "field": "spatial-field"}
    if options.get("model") == "spatial":
        return spatial.get(options["task"], GAIT) if task.env_id == "SnakeSpatial-v1" else GAIT
    return "general" if options["task"] not in ("free", "command") else GAIT


def view(
    policy: Any = None,
    env: Any = None,
    *,
    host: str = "127.0.0.1",
    port: int = 8080,
    normalize: Any = None,
    trust: bool = False,
    **options: Any,
) -> Live:
    """Runs a policy in the browser, where people can steer the robot and move obstacles; needs the extra ``view``.

    Args:
        policy: a name, file or object, as :func:`snake_env.load_policy` takes them; None: a shipped policy that fits
            the task, else the gait of action zero.
        env: name of a task, id, or an environment made with this package; None: where the policy was trained.
        host: interface that serves the page; by default only this machine sees it.
        port: of the page; the next free one if it is taken.
        normalize: file of a ``VecNormalize``, see :func:`snake_env.load_policy`.
        trust: the policy's file may run code, see :func:`snake_env.load_policy`.
        **options: keywords of the environment, such as ``difficulty``.

    Returns:
        The page, whose address is printed: ``.url``, ``.wait()`` until the process is interrupted, ``.stop()``.

    Raises:
        ConfigError: the policy or the environment is not admissible.
    """
    if policy is None:
        policy = fitting(acting_in(GAIT, TASK if env is None else env, options=options)[1])
        env = TASK if env is None else env
    actor, task = acting_in(policy, env, options=options, normalize=normalize, trust=trust)
    is_listed = isinstance(policy, str) and policy in (GAIT, *SCRIPTED, *NAMES)
    page = Live(task, policy if is_listed else actor, host, port)
    print(f"{page.url}  (Ctrl-C stops)", flush=True)
    return page


def _start(state: State) -> dict[str, Start]:
    """The present pose of a planar robot as the start of an episode."""
    if state.link_angle is None:
        return {}
    x, y = state.link_position[0]
    start = Start(position=(float(x), float(y)), heading=float(state.link_angle[0]), posture=state.joint_angle.tolist())
    return {"start": start}


def _place(obstacle: Any) -> Any:
    """Middle of an obstacle (2,) [m]."""
    if isinstance(obstacle, tuple):
        return np.array(obstacle[1:3], float)
    if hasattr(obstacle, "x"):
        return np.array([obstacle.x, obstacle.y], float)
    if isinstance(obstacle, HeightField):
        sides = obstacle.spacing * (np.array(np.shape(obstacle.height)) - 1)
        return np.asarray(obstacle.origin, float) + 0.5 * sides
    points = obstacle.vertices if hasattr(obstacle, "vertices") else (obstacle.start, obstacle.end)
    return np.asarray(points, float)[:, :2].mean(axis=0)
