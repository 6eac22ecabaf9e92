//! The reference generator: joint references that stay smooth whatever the actions do.
//!
//! The reference of joint i (0-based) is the travelling wave (T 2.14) plus an offset of its own,
//! `phi_i = A sin(psi + i beta) + gamma + offset_i` with `psi' = omega`. Every parameter is a
//! [`FilteredParameter`]; `psi` is the closed-form integral of the channel omega, so the wave never jumps, and
//! rate and acceleration follow by the chain rule.

use std::sync::Arc;

use serde::{Deserialize, Serialize};

use crate::gait::{Jet, JointReference, JointTarget, Wave, WaveJets, turned};

use super::action::{ActionEntry, WAVE_PARAMETERS, entries};
use super::config::ActionMode;
use super::filtered_parameter::{Filter, FilteredParameter, Limits};
use super::motion::wrap_angle;

/// Joint references driven by actions, one control period after the other.
#[derive(Debug, Clone)]
pub struct ReferenceGenerator {
    filter: Filter,
    mode: ActionMode,
    /// Shared by all robots of a batch.
    entries: Arc<[ActionEntry]>,
    limits: Arc<[Limits]>,
    state: ReferenceState,
}

/// What changes from one control instant to the next.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ReferenceState {
    /// Time of the last control instant \[s\].
    instant: f64,
    /// Phase psi of the wave at that instant, in [-pi, pi].
    phase: f64,
    amplitude: FilteredParameter,
    frequency: FilteredParameter,
    phase_shift: FilteredParameter,
    offset: FilteredParameter,
    /// Offsets of single joints; empty in mode `gait`.
    joints: Vec<FilteredParameter>,
}

impl ReferenceGenerator {
    pub fn new(mode: ActionMode, joints: usize, period: f64) -> Self {
        Self::with_entries(entries(mode, joints), mode, joints, period)
    }

    /// A generator with ranges of its own; `entries` are those of the mode, in the same order.
    pub fn with_entries(entries: Vec<ActionEntry>, mode: ActionMode, joints: usize, period: f64) -> Self {
        let entries: Arc<[ActionEntry]> = entries.into();
        let limits = entries.iter().map(ActionEntry::limits).collect();
        let channels = if mode == ActionMode::Gait { 0 } else { joints };
        let state = ReferenceState {
            instant: 0.0,
            phase: 0.0,
            amplitude: FilteredParameter::at_rest(0.0),
            frequency: FilteredParameter::at_rest(0.0),
            phase_shift: FilteredParameter::at_rest(0.0),
            offset: FilteredParameter::at_rest(0.0),
            joints: vec![FilteredParameter::at_rest(0.0); channels],
        };
        Self { filter: Filter::new(period), mode, entries, limits, state }
    }

    /// The entries of an action.
    pub fn entries(&self) -> &[ActionEntry] {
        &self.entries
    }

    /// Time of the last control instant \[s\].
    pub fn instant(&self) -> f64 {
        self.state.instant
    }

    pub fn filter(&self) -> &Filter {
        &self.filter
    }

    pub fn state(&self) -> &ReferenceState {
        &self.state
    }

    /// Takes over a saved state if it has the shape of this generator's.
    pub fn restore(&mut self, state: &ReferenceState) -> bool {
        let fits = state.joints.len() == self.state.joints.len();
        if fits {
            self.state.clone_from(state);
        }
        fits
    }

    /// Rests in the posture of `wave` at phase `phase`, at time zero.
    ///
    /// Where a wave is commanded its frequency starts at zero, so that a robot at rest in this posture
    /// follows the reference from the first moment.
    pub fn rest_in_posture(&mut self, wave: &Wave, phase: f64) {
        let state = &mut self.state;
        (state.instant, state.phase) = (0.0, phase);
        let wave_is_commanded = self.mode != ActionMode::Joints;
        let of_wave = |value: f64| FilteredParameter::at_rest(if wave_is_commanded { value } else { 0.0 });
        state.amplitude = of_wave(wave.amplitude);
        state.frequency = FilteredParameter::at_rest(0.0);
        state.phase_shift = of_wave(wave.beta);
        state.offset = of_wave(wave.gamma);
        for (joint, channel) in state.joints.iter_mut().enumerate() {
            let angle = wave.amplitude * (phase + joint as f64 * wave.beta).sin() + wave.gamma;
            *channel = FilteredParameter::at_rest(if wave_is_commanded { 0.0 } else { angle });
        }
    }

    /// Steers the channels towards an action in [-1, 1]; the new period begins at `time` \[s\].
    pub fn set_action(&mut self, action: &[f64], time: f64) {
        self.state.instant = time;
        let (filter, state) = (&self.filter, &mut self.state);
        let channels = [&mut state.amplitude, &mut state.frequency, &mut state.phase_shift, &mut state.offset];
        let wave_channels = if self.mode == ActionMode::Joints { 0 } else { WAVE_PARAMETERS };
        let channels = channels.into_iter().take(wave_channels).chain(&mut state.joints);
        for (((channel, entry), limits), &action) in
            channels.zip(self.entries.iter()).zip(self.limits.iter()).zip(action)
        {
            channel.set_target(entry.value(action), limits, filter);
        }
    }

    /// Keeps the targets of the channels; the new period begins at `time` \[s\].
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
        let channels = [&mut state.amplitude, &mut state.frequency, &mut state.phase_shift, &mut state.offset];
        channels.into_iter().chain(&mut state.joints).for_each(|channel| channel.finish_period(filter));
    }

    /// Phase psi of the wave at the control instant \[rad\].
    pub fn phase(&self) -> f64 {
        self.state.phase
    }

    /// Sine and cosine of the phase, then the wave's parameters at the control instant as actions that would hold them.
    pub fn describe_wave(&self, values: &mut [f64]) {
        (values[0], values[1]) = self.phase().sin_cos();
        for ((value, entry), parameter) in values[2..].iter_mut().zip(self.entries()).zip(self.wave()) {
            *value = entry.normalised(parameter);
        }
    }

    /// Reference angle of a joint at the control instant \[rad\].
    pub fn angle(&self, joint: usize) -> f64 {
        self.target(joint, self.state.instant).angle
    }

    /// The wave's parameters at the control instant, in the order of the action.
    pub fn wave(&self) -> [f64; WAVE_PARAMETERS] {
        let state = &self.state;
        [state.amplitude, state.frequency, state.phase_shift, state.offset]
            .map(|channel| channel.jet(0.0, 1.0, &self.filter).value)
    }
}

impl ReferenceGenerator {
    /// The wave at `time`, and the filter's decay since the control instant.
    pub(super) fn wave_at(&self, time: f64) -> (WaveJets, f64) {
        let (filter, state) = (&self.filter, &self.state);
        let elapsed = time - state.instant;
        let decay = filter.decay(elapsed);
        let wave = WaveJets {
            phase: state.phase + state.frequency.integral(elapsed, decay, filter),
            amplitude: state.amplitude.jet(elapsed, decay, filter),
            frequency: state.frequency.jet(elapsed, decay, filter),
            phase_shift: state.phase_shift.jet(elapsed, decay, filter),
            offset: state.offset.jet(elapsed, decay, filter),
        };
        (wave, decay)
    }

    /// The joint's own offset.
    pub(super) fn own(&self, joint: usize, time: f64, decay: f64) -> Jet {
        let elapsed = time - self.state.instant;
        self.state.joints.get(joint).map_or(Jet::default(), |channel| channel.jet(elapsed, decay, &self.filter))
    }
}

impl JointReference for ReferenceGenerator {
    fn target(&self, joint: usize, time: f64) -> JointTarget {
        let (wave, decay) = self.wave_at(time);
        bend_joint(&wave, joint, self.own(joint, time, decay))
    }

    fn targets(&self, time: f64, targets: &mut [JointTarget]) {
        let (wave, decay) = self.wave_at(time);
        bend_joints(&wave, targets.iter_mut(), |joint| self.own(joint, time, decay));
    }

    fn travelling_wave(&self, time: f64) -> Option<WaveJets> {
        self.state.joints.is_empty().then(|| self.wave_at(time).0)
    }
}

/// All joints with two evaluations of sine and cosine: the phase is turned from joint to joint. `own` is what a joint
/// adds to the wave.
pub(super) fn bend_joints<'a>(
    wave: &WaveJets,
    targets: impl Iterator<Item = &'a mut JointTarget>,
    own: impl Fn(usize) -> Jet,
) {
    let (mut phase, phase_shift) = (wave.phase.sin_cos(), wave.phase_shift.value.sin_cos());
    for (joint, target) in targets.enumerate() {
        *target = bent(wave.joint(joint, phase), own(joint));
        phase = turned(phase, phase_shift);
    }
}

/// One joint, which adds `own` to the wave.
pub(super) fn bend_joint(wave: &WaveJets, joint: usize, own: Jet) -> JointTarget {
    let phase = wave.phase + joint as f64 * wave.phase_shift.value;
    bent(wave.joint(joint, phase.sin_cos()), own)
}

fn bent(wave: Jet, own: Jet) -> JointTarget {
    JointTarget {
        angle: wave.value + own.value,
        rate: wave.rate + own.rate,
        acceleration: wave.acceleration + own.acceleration,
    }
}
