"""A robot that runs while one watches: choose task and policy, change gait and friction, move obstacles."""

from __future__ import annotations

import threading
import time
from collections import deque
from typing import Any

import gymnasium as gym
import numpy as np

from snake_env.config import Start
from snake_env.errors import ConfigError
from snake_env.evaluation import seeds, tasks
from snake_env.evaluation.acting import BASELINE, acting
from snake_env.evaluation.tasks import BenchmarkTask
from snake_env.policies.gaits import DEGREE, ConstantAction, GaitParameters
from snake_env.policies.scripted import catalogue
from snake_env.policies.shipped import NAMES
from snake_env.state import State
from snake_env.viewer.camera import Follower, look_at
from snake_env.viewer.drawing import Drawing
from snake_env.viewer.frames import Frames
from snake_env.viewer.player import close, server
from snake_env.viewer.plots import Plots
from snake_env.viewer.pull import Pull

MEMORY = 200
"""Control instants in the plots."""
KEYS = {
    "arrowleft": ("gamma", -2.0),
    "arrowright": ("gamma", 2.0),
    "arrowup": ("omega", 10.0),
    "arrowdown": ("omega", -10.0),
}
"""Keys of the page: the slider of the gait that each moves, and by how much."""
PLOTTED = 10
"""Control instants between two changes of the plots, which cost more than the robot."""


class Live:
    """A page with one running robot; the simulation is on a thread of its own until :meth:`stop`.

    Args:
        task: of the first episode.
        policy: as :func:`snake_env.evaluation.acting.acting` names it.
        host: interface that serves the page.
        port: of the page; the next free one if it is taken.

    Raises:
        ConfigError: the policy does not fit the task.
    """

    def __init__(self, task: BenchmarkTask, policy: str = BASELINE, host: str = "127.0.0.1", port: int = 8080) -> None:
        self._tasks = tasks.load() | {task.name: task}
        self._env: Any = None
        self._lock = threading.RLock()
        self._changed: dict[str, Any] = {}
        """Scene and start of episodes after an obstacle was moved."""
        self._states: deque[State] = deque(maxlen=MEMORY)
        self.server = server(host, port)
        self._controls(task, policy)
        try:
            self._begin()
        except ConfigError:
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

    def _controls(self, task: BenchmarkTask, policy: str) -> None:
        gui = self.server.gui
        self.playing = gui.add_checkbox("playing", initial_value=True)
        self.speed = gui.add_slider("speed", 0.1, 4.0, 0.1, initial_value=1.0)
        self.camera = Follower(self.server, initial=True)
        self.task = gui.add_dropdown("task", tuple(self._tasks), initial_value=task.name)
        actors = tuple(dict.fromkeys((BASELINE, *catalogue.CONTROLLERS, *NAMES, policy)))
        self.policy = gui.add_dropdown("policy", actors, initial_value=policy)
        self.scene = gui.add_number("test scene", initial_value=0, min=0, max=len(seeds.HELD_OUT) - 1, step=1)
        self.own_friction = gui.add_checkbox("own friction", initial_value=False)
        self.friction = gui.add_slider("friction", 0.05, 1.0, 0.01, initial_value=0.2)
        self.restart = gui.add_button("restart")
        with gui.add_folder("gait (policy: gait)"):
            self.amplitude = gui.add_slider("amplitude [deg]", 5.0, 65.0, 1.0, initial_value=40.0)
            self.omega = gui.add_slider("frequency [deg/s]", -40.0, 200.0, 1.0, initial_value=80.0)
            self.beta = gui.add_slider("phase shift [deg]", -65.0, -15.0, 1.0, initial_value=-50.0)
            self.gamma = gui.add_slider("offset [deg]", -25.0, 25.0, 0.5, initial_value=0.0)
        with gui.add_folder("obstacle"):
            hint = "0: none; drag it in the scene"
            self.obstacle = gui.add_number("number", initial_value=0, min=0, step=1, hint=hint)
        with gui.add_folder("push"):
            hint = "0: none; drag the handle at the link, and a spring pulls it"
            self.link = gui.add_number("link", initial_value=0, min=0, step=1, hint=hint)
        for key, (name, change) in KEYS.items():
            self._key(key, name, change)
        self.note = gui.add_markdown("")
        self._plots = Plots(gui)
        self._handle: Any = None
        self._pull: Pull | None = None
        for control in (self.task, self.policy, self.scene, self.own_friction, self.friction):
            control.on_update(lambda _: self._again(forget=True))
        self.restart.on_click(lambda _: self._again(forget=False))
        for slider in (self.amplitude, self.omega, self.beta, self.gamma):
            slider.on_update(lambda _: self._steer())
        self.obstacle.on_update(lambda _: self._grip())
        self.link.on_update(lambda _: self._take_hold())

    def _key(self, key: Any, name: str, change: float) -> None:
        """Lets a key of the page change a slider of the gait."""
        slider = getattr(self, name)
        command = self.server.gui.add_command(f"{name} {change:+g}", hotkey=key)
        command.on_trigger(lambda _: self.drive(slider, change))

    def drive(self, slider: Any, change: float) -> None:
        """Moves a slider of the gait, as far as it goes."""
        slider.value = min(slider.max, max(slider.min, slider.value + change))
        self._steer()

    def _again(self, forget: bool) -> None:
        """Begins anew; with the scene as it has been changed by hand, unless ``forget``."""
        with self._lock:
            if forget:
                self._changed = {}
            try:
                self._begin()
            except (ConfigError, gym.error.Error) as error:
                self.note.content = f"**{error}**"

    def _begin(self) -> None:
        """A new episode of what the page says; nothing changes if that is refused."""
        chosen = self._tasks[self.task.value]
        options = dict(chosen.options)
        if self.own_friction.value:
            options["friction"] = (self.friction.value, self.friction.value)
        chosen = BenchmarkTask(chosen.name, chosen.env_id, options, chosen.about)
        actor = acting(self.policy.value, chosen)
        options |= actor.env_options
        env: Any = gym.make_vec(chosen.env_id, 1, num_threads=1, autoreset_mode="Disabled", **options)
        given = {"options": self._changed} if self._changed else {}
        self._observation, _ = env.reset(seed=[seeds.HELD_OUT[int(self.scene.value)]], **given)
        if self._env is not None:
            self._env.close()
        self._env, self._actor = env, actor
        actor.begin(env.unwrapped.layout, 1)
        self._steer()
        self._states.clear()
        self._remember()
        self.server.scene.reset()
        self._handle = self._pull = None
        self._drawing = Drawing(self.server.scene, self._frames(), trail=False)
        self._grip()
        self._take_hold()
        self.note.content = chosen.about

    def _steer(self) -> None:
        """Commands the gait of the sliders, where the gait is what acts."""
        if self.policy.value == BASELINE and isinstance(self._actor, ConstantAction):
            degrees = (self.amplitude.value, self.omega.value, self.beta.value, self.gamma.value)
            try:
                self._actor.action = GaitParameters(*(v * DEGREE for v in degrees)).action(
                    self._env.unwrapped.layout["action"]
                )
                self.note.content = ""
            except ConfigError as error:
                self.note.content = f"**{error}**"

    def _grip(self) -> None:
        """Puts a handle on the chosen obstacle; when it is let go, the episode begins anew with the obstacle there."""
        with self._lock:
            if self._handle is not None:
                self._handle.remove()
                self._handle = None
            scene, j = self._env.unwrapped.scene(0), int(self.obstacle.value)
            if not 1 <= j <= len(scene.obstacles):
                return
            place = _place(scene.obstacles[j - 1])
            handle = self.server.scene.add_transform_controls(
                "/handle", scale=0.3, position=(*place, 0.1), active_axes=(True, True, False), disable_rotations=True
            )

            def let_go(event: Any) -> None:
                if event.phase != "end":
                    return
                dx, dy = np.asarray(handle.position)[:2] - place
                self.move(j, float(dx), float(dy))

            handle.on_update(let_go)
            self._handle = handle

    def _take_hold(self) -> None:
        """Puts a handle on the chosen link, by which it can be pulled."""
        with self._lock:
            if self._pull is not None:
                self._pull.remove()
                self._pull = None
            link = int(self.link.value)
            if 1 <= link <= len(self.state.link_radius):
                self._pull = Pull(self.server.scene, link - 1, self.state)

    def move(self, j: int, dx: float, dy: float) -> None:
        """Shifts obstacle ``j`` (1-based) by (dx, dy) [m]; the robot begins anew where it is, at rest.

        Robots in 3D begin at their usual start.
        """
        with self._lock:
            before = self._changed
            self._changed = {"scene": self._env.unwrapped.scene(0).moved(j, dx, dy)} | _start(self.state)
            try:
                self._begin()
            except ConfigError as error:
                self._changed = before
                self.note.content = f"**{error}**"

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
            with self._lock:
                ended = self._step()
                period = float(self._env.unwrapped.control_period)
                if (steps := steps + 1) % PLOTTED == 0 or ended:
                    self._show_past()
                if ended:
                    self.note.content = "goal reached" if self._info["is_success"][0] else "episode over"
                    self._begin()
            due = max(due + period / self.speed.value, time.perf_counter() - period)
            time.sleep(max(0.0, due - time.perf_counter()))

    def advance(self, steps: int) -> None:
        """Takes so many control periods at once while the page is paused, or fewer where the episode ends.

        Pages that open later look at the robot.
        """
        with self._lock:
            for _ in range(steps):
                if self._step():
                    break
            self._show_past()
            look_at(self.server, Frames.of_states([self.state], self._env.unwrapped.scene(0)))

    def _show_past(self) -> None:
        """Plots and trail."""
        frames = self._frames()
        self._plots.show(frames)
        if len(frames) > 1:
            self._drawing.trail(frames.position.mean(axis=1))

    def _step(self) -> bool:
        """One control period; whether the episode has ended."""
        if self._pull is not None:
            impulse = self._pull.impulse(self.state, float(self._env.unwrapped.control_period))
            if impulse is not None:
                self._env.unwrapped.push(impulse)
        self._observation, _, terminated, truncated, self._info = self._env.step(self._actor(self._observation))
        self._remember()
        last = Frames.of_states([self.state], self._env.unwrapped.scene(0))
        self._drawing.show(last, 0)
        self.camera.show(last, 0)
        return bool(terminated[0] or truncated[0])


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
    points = obstacle.points if hasattr(obstacle, "points") else (obstacle.start, obstacle.end)
    return np.asarray(points, float).mean(axis=0)
