//! The reference generator: joint references that stay smooth whatever the actions do.
//!
//! The reference of joint i (0-based) about an axis is the travelling wave (T 2.14) plus an angle of its own,
//! `phi_i = A sin(psi + delta + i beta) + gamma + offset_i` with `psi' = omega`. The waves of all axes share omega and
//! beta; delta is the phase of a wave relative to that of the yaw angles. Every parameter is a [`FilteredParameter`];
//! `psi` is the closed-form integral of omega, so the wave never jumps, and rate and acceleration follow by the chain
//! rule.

use std::sync::Arc;

use serde::{Deserialize, Serialize};

use crate::control::AxisGains;
use crate::gait::{CardanTarget, Jet, JointTarget, Reference, WaveJets, turned};
use crate::robot::Axes;

use super::action::{ActionEntry, LARGEST_ANGLE, PITCH, Parameter, YAW};
use super::default_gait::DefaultGait;
use super::filtered_parameter::{Filter, FilteredParameter, Limits};
use super::motion::wrap_angle;

/// References of joints with `AXES` axes, driven by actions, one control period after the other.
#[derive(Debug, Clone)]
pub struct ReferenceGenerator<const AXES: usize> {
    filter: Filter,
    gait: DefaultGait,
    /// Whether actions set the parameters of waves.
    has_wave: bool,
    /// Shared by all robots of a batch.
    entries: Arc<[ActionEntry]>,
    limits: Arc<[Limits]>,
    /// Joints that waves pass by, see [`Axes::only_twists`].
    passed: Arc<[usize]>,
    state: ReferenceState,
}

/// What changes from one control instant to the next.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ReferenceState {
    /// Time of the last control instant \[s\].
    instant: f64,
    /// Phase psi of the wave of the yaw angles at that instant, in [-pi, pi].
    phase: f64,
    frequency: FilteredParameter,
    phase_shift: FilteredParameter,
    axes: Vec<Axis>,
    held: Vec<Held>,
}

/// A locked joint, which keeps its angles of the start.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Held {
    pub joint: usize,
    /// About each axis, the yaw angle first; zero where there is none \[rad\].
    pub angle: [f64; 2],
}

/// The wave of one axis of the joints, and what single joints add to it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
struct Axis {
    amplitude: FilteredParameter,
    /// delta, relative to the wave of the yaw angles.
    phase: FilteredParameter,
    offset: FilteredParameter,
    /// What actions set of single joints, angles or rates; empty where they set neither.
    joints: Vec<FilteredParameter>,
    /// Reference angles at the control instant, where actions set their rates, else empty \[rad\].
    angles: Vec<f64>,
    /// Torques of the actuators, where actions set them, else empty \[N m\].
    torques: Vec<f64>,
}

impl<const AXES: usize> ReferenceGenerator<AXES> {
    /// A generator for an action with these entries, whose centres hold `gait`.
    pub fn new(entries: Vec<ActionEntry>, gait: DefaultGait, period: f64) -> Self {
        // Up to the last joint that has one.
        let count = |parameter: fn(usize, usize) -> Parameter, axis: usize| {
            let own = entries.iter().filter_map(|entry| Some((entry.parameter, entry.parameter.of_joint()?)));
            let joints = own.filter(|(own, (of, joint))| *of == axis && *own == parameter(axis, *joint));
            joints.map(|(_, (_, joint))| joint + 1).max().unwrap_or(0)
        };
        let axis = |axis: usize| {
            let angles = count(|axis, joint| Parameter::Joint { axis, joint }, axis);
            let rates = count(|axis, joint| Parameter::JointRate { axis, joint }, axis);
            let torques = count(|axis, joint| Parameter::JointTorque { axis, joint }, axis);
            Axis::at_rest(angles + rates, rates, torques)
        };
        let state = ReferenceState {
            instant: 0.0,
            phase: 0.0,
            frequency: FilteredParameter::at_rest(0.0),
            phase_shift: FilteredParameter::at_rest(0.0),
            axes: (0..AXES).map(axis).collect(),
            held: Vec::new(),
        };
        Self {
            filter: Filter::new(period),
            gait,
            has_wave: entries.iter().any(|entry| entry.parameter.is_of_wave()),
            limits: entries.iter().map(ActionEntry::limits).collect(),
            entries: entries.into(),
            passed: Arc::default(),
            state,
        }
    }

    /// Of a robot whose joints have these axes.
    pub fn on(self, axes: &[Axes]) -> Self {
        let passed = axes.iter().enumerate().filter(|(_, axes)| axes.only_twists()).map(|(joint, _)| joint);
        Self { passed: passed.collect(), ..self }
    }

    /// The entries of an action.
    pub fn entries(&self) -> &[ActionEntry] {
        &self.entries
    }

    pub fn filter(&self) -> &Filter {
        &self.filter
    }

    pub fn state(&self) -> &ReferenceState {
        &self.state
    }

    /// Takes over a saved state if it has the shape of this generator's.
    pub fn restore(&mut self, state: &ReferenceState) -> bool {
        let lengths = |axis: &Axis| [axis.joints.len(), axis.angles.len(), axis.torques.len()];
        let shape = |state: &ReferenceState| state.axes.iter().map(lengths).collect::<Vec<_>>();
        let held = |state: &ReferenceState| state.held.iter().map(|held| held.joint).collect::<Vec<_>>();
        let fits = shape(state) == shape(&self.state) && held(state) == held(&self.state);
        if fits {
            self.state.clone_from(state);
        }
        fits
    }

    /// Rests in the flat posture of the gait at phase `phase`, at time zero.
    ///
    /// Where a wave is commanded its frequency starts at zero, so that a robot at rest in this posture
    /// follows the reference from the first moment; a vertical wave grows from zero.
    pub fn rest_in_posture(&mut self, phase: f64) {
        let (state, wave) = (&mut self.state, &self.gait.yaw);
        (state.instant, state.phase) = (0.0, phase);
        let has_wave = self.has_wave;
        let of_wave = |value: f64| FilteredParameter::at_rest(if has_wave { value } else { 0.0 });
        state.frequency = FilteredParameter::at_rest(0.0);
        state.phase_shift = of_wave(wave.beta);
        for axis in &mut state.axes {
            axis.amplitude = FilteredParameter::at_rest(0.0);
            axis.phase = of_wave(self.gait.lift_phase);
            axis.offset = FilteredParameter::at_rest(0.0);
            axis.joints.fill(FilteredParameter::at_rest(0.0));
            axis.angles.fill(0.0);
            axis.torques.fill(0.0);
        }
        let yaw = &mut state.axes[YAW];
        yaw.amplitude = of_wave(wave.amplitude);
        yaw.phase = FilteredParameter::at_rest(0.0);
        yaw.offset = of_wave(wave.gamma);
        if !has_wave {
            let passed = &self.passed;
            let of_wave = |joint: usize| wave.amplitude * (phase + joint as f64 * wave.beta).sin() + wave.gamma;
            yaw.hold(|joint| if passed.contains(&joint) { 0.0 } else { of_wave(joint) });
        }
    }

    /// Rests in another posture, with the angles `joint_angle(joint, axis)`: references of single joints hold them, and
    /// waves grow from zero.
    pub fn rest_bent(&mut self, joint_angle: impl Fn(usize, usize) -> f64) {
        let has_wave = self.has_wave;
        for (index, axis) in self.state.axes.iter_mut().enumerate() {
            axis.amplitude = FilteredParameter::at_rest(0.0);
            axis.offset = FilteredParameter::at_rest(0.0);
            if !has_wave {
                axis.hold(|joint| joint_angle(joint, index));
            }
        }
    }

    /// The same with both waves at their full amplitudes, which wind the robot, where actions set waves.
    pub fn rest_wound(&mut self, joint_angle: impl Fn(usize, usize) -> f64) {
        self.rest_bent(joint_angle);
        if self.has_wave {
            self.state.axes[YAW].amplitude = FilteredParameter::at_rest(self.gait.yaw.amplitude);
            self.state.axes[PITCH].amplitude = FilteredParameter::at_rest(self.gait.lift);
        }
    }

    /// Locks joints at angles, whatever waves and actions do.
    pub fn lock(&mut self, held: impl Iterator<Item = Held>) {
        self.state.held.clear();
        self.state.held.extend(held);
    }

    /// Moves the parameters towards an action in [-1, 1]; the new period begins at `time` \[s\].
    pub fn set_action(&mut self, action: &[f64], time: f64) {
        self.state.instant = time;
        for ((entry, limits), &action) in self.entries.iter().zip(self.limits.iter()).zip(action) {
            let value = entry.value(action);
            match entry.parameter {
                Parameter::JointTorque { axis, joint } => self.state.axes[axis].torques[joint] = value,
                Parameter::JointRate { axis, joint } => {
                    let Axis { joints, angles, .. } = &mut self.state.axes[axis];
                    let rate = braked(value, angles[joint], self.filter.bandwidth);
                    joints[joint].set_target(rate, limits, &self.filter);
                }
                parameter => self.state.parameter_mut(parameter).set_target(value, limits, &self.filter),
            }
        }
    }

    /// Where actions set rates: keeps each reference angle within `reach` \[rad\] of the angle of its joint about the
    /// axis, so that a joint that is held up does not have to make up for the time.
    pub fn limit_windup(&mut self, gains: &[[AxisGains; 2]], joint_angle: impl Fn(usize, usize) -> f64) {
        for (axis, Axis { angles, .. }) in self.state.axes.iter_mut().enumerate() {
            for (joint, angle) in angles.iter_mut().enumerate() {
                let (present, reach) = (joint_angle(joint, axis), gains[joint][axis].saturation());
                *angle = angle.clamp(present - reach, present + reach);
            }
        }
    }

    /// Keeps the targets of the parameters; the new period begins at `time` \[s\].
    pub fn hold_reference(&mut self, time: f64) {
        self.state.instant = time;
    }

    /// Moves on to the end of the control period.
    pub fn finish_period(&mut self) {
        let (filter, state) = (&self.filter, &mut self.state);
        let period = filter.period;
        let turned = state.phase + state.frequency.integral(period, filter.period_decay(), filter);
        state.phase = wrap_angle(turned);
        state.instant += period;
        state.frequency.finish_period(filter);
        state.phase_shift.finish_period(filter);
        for Axis { amplitude, phase, offset, joints, angles, .. } in &mut state.axes {
            for (angle, rate) in angles.iter_mut().zip(&*joints) {
                *angle += rate.integral(period, filter.period_decay(), filter);
            }
            [amplitude, phase, offset].into_iter().chain(joints).for_each(|parameter| parameter.finish_period(filter));
        }
    }

    /// Phase psi of the wave of the yaw angles at the control instant \[rad\].
    pub fn phase(&self) -> f64 {
        self.state.phase
    }

    /// Sine and cosine of the phase, then the waves' parameters at the control instant as actions that would hold them.
    pub fn describe_wave(&self, values: &mut [f64]) {
        (values[0], values[1]) = self.phase().sin_cos();
        let entries = self.entries.iter().filter(|entry| entry.parameter.is_of_wave());
        for (value, entry) in values[2..].iter_mut().zip(entries) {
            let parameter = self.state.parameter(entry.parameter);
            *value = entry.normalised(parameter.jet(0.0, 1.0, &self.filter).value);
        }
    }

    /// Reference angles at the control instant of these joints and axes \[rad\].
    pub fn angles(&self, axes: impl Iterator<Item = (usize, usize)>, values: &mut [f64]) {
        let (waves, decay) = self.waves_at(self.state.instant);
        for ((joint, axis), value) in axes.zip(values) {
            let held = self.state.held.iter().find(|held| held.joint == joint);
            let moving = || self.joint_target(axis, &waves[axis], joint, decay, 0.0).angle;
            *value = held.map_or_else(moving, |held| held.angle[axis]);
        }
    }

    /// The references of a joint about its axes at `time` \[s\].
    pub fn joint_targets(&self, joint: usize, time: f64) -> [JointTarget; AXES] {
        if let Some(held) = self.state.held.iter().find(|held| held.joint == joint) {
            return std::array::from_fn(|axis| held.target(axis));
        }
        let (waves, decay) = self.waves_at(time);
        let elapsed = time - self.state.instant;
        std::array::from_fn(|axis| self.joint_target(axis, &waves[axis], joint, decay, elapsed))
    }

    /// The waves at `time`, and the filter's decay since the control instant.
    fn waves_at(&self, time: f64) -> ([WaveJets; AXES], f64) {
        let (filter, state) = (&self.filter, &self.state);
        let elapsed = time - state.instant;
        let decay = filter.decay(elapsed);
        if !self.has_wave {
            return (std::array::from_fn(|_| WaveJets::still()), decay);
        }
        let phase = state.phase + state.frequency.integral(elapsed, decay, filter);
        let frequency = state.frequency.jet(elapsed, decay, filter);
        let phase_shift = state.phase_shift.jet(elapsed, decay, filter);
        let waves = std::array::from_fn(|axis| {
            let axis = &state.axes[axis];
            let delta = axis.phase.jet(elapsed, decay, filter);
            WaveJets {
                phase: phase + delta.value,
                amplitude: axis.amplitude.jet(elapsed, decay, filter),
                frequency: Jet {
                    value: frequency.value + delta.rate,
                    rate: frequency.rate + delta.acceleration,
                    ..frequency
                },
                phase_shift,
                offset: axis.offset.jet(elapsed, decay, filter),
            }
        });
        (waves, decay)
    }

    /// What a joint adds to the wave of an axis. Inlined and in parts: a jet that goes by way of memory delays every joint of
    /// every stage.
    #[inline(always)]
    fn own(&self, axis: usize, joint: usize, decay: f64, elapsed: f64) -> Jet {
        let Axis { joints, angles, .. } = &self.state.axes[axis];
        let Some(parameter) = joints.get(joint) else { return Jet::default() };
        let Jet { value, rate, acceleration } = parameter.jet(elapsed, decay, &self.filter);
        match angles.get(joint) {
            None => Jet { value, rate, acceleration },
            Some(angle) => {
                let angle = angle + parameter.integral(elapsed, decay, &self.filter);
                Jet { value: angle, rate: value, acceleration: rate }
            }
        }
    }

    /// The torques that actions have set, if they do.
    fn own_torques(&self, torques: &mut [f64]) -> bool {
        if self.state.axes.iter().all(|axis| axis.torques.is_empty()) {
            return false;
        }
        for (axis, Axis { torques: own, .. }) in self.state.axes.iter().enumerate() {
            torques.iter_mut().skip(axis).step_by(AXES).zip(own).for_each(|(torque, own)| *torque = *own);
        }
        true
    }

    /// One joint.
    fn joint_target(&self, axis: usize, wave: &WaveJets, joint: usize, decay: f64, elapsed: f64) -> JointTarget {
        let phase = wave.phase + joint as f64 * wave.phase_shift.value;
        let is_passed = self.passed.contains(&joint);
        let wave = if is_passed { Jet::default() } else { wave.joint(joint, phase.sin_cos()) };
        sum(wave, self.own(axis, joint, decay, elapsed))
    }

    /// All joints with two evaluations of sine and cosine: the phase is turned from joint to joint.
    fn all_targets<'a>(
        &self,
        axis: usize,
        wave: &WaveJets,
        targets: impl Iterator<Item = &'a mut JointTarget>,
        decay: f64,
        elapsed: f64,
    ) {
        if !self.has_wave {
            let own = |joint| sum(Jet::default(), self.own(axis, joint, decay, elapsed));
            targets.enumerate().for_each(|(joint, target)| *target = own(joint));
            return;
        }
        let (mut phase, phase_shift) = (wave.phase.sin_cos(), wave.phase_shift.value.sin_cos());
        for (joint, target) in targets.enumerate() {
            *target = sum(wave.joint(joint, phase), self.own(axis, joint, decay, elapsed));
            phase = turned(phase, phase_shift);
        }
    }
}

impl ReferenceState {
    fn parameter(&self, parameter: Parameter) -> &FilteredParameter {
        match parameter {
            Parameter::Frequency => &self.frequency,
            Parameter::PhaseShift => &self.phase_shift,
            Parameter::Amplitude(axis) => &self.axes[axis].amplitude,
            Parameter::Phase(axis) => &self.axes[axis].phase,
            Parameter::Offset(axis) => &self.axes[axis].offset,
            Parameter::Joint { axis, joint } | Parameter::JointRate { axis, joint } => &self.axes[axis].joints[joint],
            Parameter::JointTorque { .. } => unreachable!("torques are not filtered"),
        }
    }

    fn parameter_mut(&mut self, parameter: Parameter) -> &mut FilteredParameter {
        match parameter {
            Parameter::Frequency => &mut self.frequency,
            Parameter::PhaseShift => &mut self.phase_shift,
            Parameter::Amplitude(axis) => &mut self.axes[axis].amplitude,
            Parameter::Phase(axis) => &mut self.axes[axis].phase,
            Parameter::Offset(axis) => &mut self.axes[axis].offset,
            Parameter::Joint { axis, joint } | Parameter::JointRate { axis, joint } => {
                &mut self.axes[axis].joints[joint]
            }
            Parameter::JointTorque { .. } => unreachable!("torques are not filtered"),
        }
    }
}

impl Held {
    fn target(&self, axis: usize) -> JointTarget {
        JointTarget { angle: self.angle[axis], ..JointTarget::default() }
    }
}

impl Axis {
    fn at_rest(joints: usize, angles: usize, torques: usize) -> Self {
        let zero = FilteredParameter::at_rest(0.0);
        Self {
            amplitude: zero,
            phase: zero,
            offset: zero,
            joints: vec![zero; joints],
            angles: vec![0.0; angles],
            torques: vec![0.0; torques],
        }
    }

    /// The references of single joints rest at these angles.
    fn hold(&mut self, angle: impl Fn(usize) -> f64) {
        if self.angles.is_empty() {
            let joints = self.joints.iter_mut().enumerate();
            joints.for_each(|(joint, parameter)| *parameter = FilteredParameter::at_rest(angle(joint)));
        } else {
            self.angles.iter_mut().enumerate().for_each(|(joint, reference)| *reference = angle(joint));
        }
    }
}

/// A commanded rate, no larger than lets a reference at `angle` come to rest at [`LARGEST_ANGLE`] on either side.
///
/// The angle then follows the rate `k (largest - angle)` through the filter with the triple pole -lambda. It settles
/// without overshoot where `-s (1 + s / lambda)^3 = k` has real roots s, that is below the maximum of the left side,
/// which lies at s = -lambda / 4: k <= 27 lambda / 256.
fn braked(rate: f64, angle: f64, bandwidth: f64) -> f64 {
    let k = BRAKING * bandwidth;
    rate.clamp((-k * (LARGEST_ANGLE + angle)).min(0.0), (k * (LARGEST_ANGLE - angle)).max(0.0))
}

/// k / lambda, a little below 27 / 256.
const BRAKING: f64 = 0.1;

impl Reference<JointTarget> for ReferenceGenerator<1> {
    fn target(&self, joint: usize, time: f64) -> JointTarget {
        self.joint_targets(joint, time)[YAW]
    }

    fn targets(&self, time: f64, targets: &mut [JointTarget]) {
        let ([wave], decay) = self.waves_at(time);
        self.all_targets(YAW, &wave, targets.iter_mut(), decay, time - self.state.instant);
        self.state.held.iter().for_each(|held| targets[held.joint] = held.target(YAW));
    }

    fn travelling_wave(&self, time: f64) -> Option<WaveJets> {
        let is_all = self.state.axes[YAW].joints.is_empty() && self.state.held.is_empty();
        is_all.then(|| self.waves_at(time).0[YAW])
    }

    fn torques(&self, _: f64, torques: &mut [f64]) -> bool {
        self.own_torques(torques)
    }
}

impl Reference<CardanTarget> for ReferenceGenerator<2> {
    fn target(&self, joint: usize, time: f64) -> CardanTarget {
        let [yaw, pitch] = self.joint_targets(joint, time);
        CardanTarget { yaw, pitch }
    }

    fn targets(&self, time: f64, targets: &mut [CardanTarget]) {
        let ([yaw, pitch], decay) = self.waves_at(time);
        let elapsed = time - self.state.instant;
        self.all_targets(YAW, &yaw, targets.iter_mut().map(|target| &mut target.yaw), decay, elapsed);
        self.all_targets(PITCH, &pitch, targets.iter_mut().map(|target| &mut target.pitch), decay, elapsed);
        for &joint in self.passed.iter() {
            targets[joint].yaw = sum(Jet::default(), self.own(YAW, joint, decay, elapsed));
        }
        for held in &self.state.held {
            targets[held.joint] = CardanTarget { yaw: held.target(YAW), pitch: held.target(PITCH) };
        }
    }

    fn torques(&self, _: f64, torques: &mut [f64]) -> bool {
        self.own_torques(torques)
    }
}

fn sum(wave: Jet, own: Jet) -> JointTarget {
    JointTarget {
        angle: wave.value + own.value,
        rate: wave.rate + own.rate,
        acceleration: wave.acceleration + own.acceleration,
    }
}
