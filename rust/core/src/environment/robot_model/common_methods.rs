//! What the robots of all models do alike.

/// The methods of [`RobotModel`](super::RobotModel) that only pass on what simulation and references do: fields that
/// robots of every model have, of other types.
macro_rules! common_methods {
    () => {
        fn simulation(&self) -> &$crate::simulation::Simulation<Self::Model> {
            &self.simulation
        }

        fn simulation_mut(&mut self) -> &mut $crate::simulation::Simulation<Self::Model> {
            &mut self.simulation
        }

        fn driven(&mut self) -> $crate::stepping::Driven<'_, Self::Model> {
            $crate::stepping::Driven { body: self.simulation.body_mut(), reference: &self.reference }
        }

        fn action_entries(&self) -> &[$crate::environment::action::ActionEntry] {
            self.reference.entries()
        }

        fn set_action(&mut self, action: &[f64]) {
            self.reference.set_action(action, self.simulation.state().time);
            self.limit_windup();
        }

        fn hold_reference(&mut self) {
            self.reference.hold_reference(self.simulation.state().time);
            self.limit_windup();
        }

        fn period(&self) -> f64 {
            self.period
        }

        fn advance(&mut self) {
            self.simulation.advance(self.period, &self.reference);
        }

        fn save(&self) -> Self::State {
            SavedRobot::save(&self.simulation, &self.reference, &self.accelerometer)
        }

        fn restore(&mut self, state: &Self::State) -> bool {
            state.restore(&mut self.simulation, &mut self.reference, &mut self.accelerometer)
        }

        fn links_of(state: &Self::State) -> usize {
            state.links().unwrap_or_default()
        }
    };
}

pub(super) use common_methods;
