//! A grid over the obstacles of a scene, so that far ones cost nothing.

use nalgebra::{Vector2, Vector3};

use super::{
    Body, ConvexPolygon, HeightField, Movable, Nodes, Obstacle, Outline, Peg, Rectangle, Shape, Solid, WallGrid,
};
use crate::error::FARTHEST;
use crate::robot::Link;

/// Pegs sorted into square cells, and walls beside them; replacing the pegs re-uses memory.
///
/// Obstacles are numbered: first the pegs, then the walls, then all other bodies. Those that can be pushed are apart: where
/// they are is part of a robot's state.
#[derive(Debug, Clone, Default)]
pub struct ObstacleGrid {
    pegs: Vec<Peg>,
    origin: [f64; 2],
    cell: f64,
    columns: usize,
    rows: usize,
    /// `order[start[c]..start[c + 1]]` are the pegs whose centre lies in cell `c`.
    start: Vec<u32>,
    order: Vec<u32>,
    largest_radius: f64,
    walls: WallGrid,
    bodies: Vec<(Rectangle, Body)>,
    movables: Vec<Movable>,
    /// Whether some of them have a stop.
    has_stops: bool,
    /// Coulomb coefficients of the obstacles; empty where all are without friction.
    friction: Vec<f64>,
    /// Heights of the obstacles, infinite without end \[m\]; empty where all are without end.
    height: Vec<f64>,
    /// Around all that have a top face, and all fields.
    tops: Rectangle,
    /// Index of each obstacle in the scene; empty where all are pegs.
    index_in_scene: Vec<usize>,
    /// The obstacles as the scene has them; empty where all are pegs without friction and end.
    written: Vec<Obstacle>,
}

impl ObstacleGrid {
    pub fn new(pegs: &[Peg]) -> Self {
        let mut grid = Self::default();
        grid.rebuild(pegs);
        grid
    }

    /// Of all obstacles of a scene, which are valid.
    pub fn of(obstacles: &[Obstacle]) -> Self {
        let of_kind = |is_one: fn(&Obstacle) -> bool| {
            obstacles.iter().enumerate().filter(move |(_, obstacle)| is_one(obstacle)).collect::<Vec<_>>()
        };
        let circles = of_kind(|obstacle| matches!(obstacle.shape, Shape::Circle(_)) && obstacle.mass.is_none());
        let walls = of_kind(Obstacle::is_wall);
        let bodies = of_kind(|obstacle| obstacle.shape.is_body());
        let peg = |(_, obstacle): &(usize, &Obstacle)| match obstacle.shape {
            Shape::Circle(peg) => Some(peg),
            _ => None,
        };
        let mut grid = Self::new(&circles.iter().filter_map(peg).collect::<Vec<_>>());
        grid.movables = obstacles.iter().filter_map(Obstacle::movable).collect();
        grid.has_stops = grid.movables.iter().any(|movable| movable.travel().is_finite());
        grid.walls = WallGrid::new(walls.iter().filter_map(|(_, obstacle)| obstacle.shape.polygon()));
        let body = |(_, obstacle): &(usize, &Obstacle)| obstacle.shape.body().expect("a valid obstacle");
        grid.bodies = bodies.iter().filter_map(body).map(|body| (body.rectangle(), body)).collect();
        let numbered = || circles.iter().chain(&walls).chain(&bodies);
        if numbered().any(|(_, obstacle)| obstacle.friction > 0.0) {
            grid.friction = numbered().map(|(_, obstacle)| obstacle.friction).collect();
        }
        if numbered().any(|(_, obstacle)| obstacle.height.is_some()) {
            grid.height = numbered().map(|(_, obstacle)| obstacle.height.unwrap_or(f64::INFINITY)).collect();
        }
        grid.tops = Rectangle::around(
            (0..grid.len())
                .filter_map(|obstacle| grid.solid(obstacle))
                .flat_map(|solid| {
                    let Rectangle { low, high } = solid.outline.rectangle();
                    [low, high]
                })
                .chain(grid.fields().flat_map(|(rectangle, _)| [rectangle.low, rectangle.high])),
        );
        if circles.len() < obstacles.len() {
            let movables = of_kind(|obstacle| obstacle.mass.is_some());
            grid.index_in_scene = numbered().chain(&movables).map(|(index, _)| *index).collect();
        }
        if !obstacles.iter().all(Obstacle::is_plain_peg) {
            grid.written = obstacles.to_vec();
        }
        grid
    }

    /// The obstacles as the scene has them.
    pub fn obstacles(&self) -> Vec<Obstacle> {
        if self.written.is_empty() {
            self.pegs.iter().copied().map(Obstacle::from).collect()
        } else {
            self.written.clone()
        }
    }

    /// The obstacle with an index in the scene.
    pub fn obstacle(&self, index: usize) -> Obstacle {
        self.written.get(index).cloned().unwrap_or_else(|| self.pegs[index].into())
    }

    pub fn walls(&self) -> &WallGrid {
        &self.walls
    }

    /// The obstacles that can be pushed, in the order of the scene.
    pub fn movables(&self) -> &[Movable] {
        &self.movables
    }

    /// The links of a robot, and behind them what it can push.
    pub fn nodes<'a>(&'a self, links: &'a [Link]) -> Nodes<'a> {
        Nodes::new(links, &self.movables)
    }

    /// Number of obstacles that are fixed.
    pub fn len(&self) -> usize {
        self.bodies_from() + self.bodies.len()
    }

    /// Number of all obstacles; those that can be pushed have the last numbers.
    pub fn total(&self) -> usize {
        self.len() + self.movables.len()
    }

    /// The number of the first body.
    fn bodies_from(&self) -> usize {
        self.pegs.len() + self.walls.walls().len()
    }

    /// An obstacle that is no vertical body.
    pub fn body(&self, obstacle: usize) -> Option<&Body> {
        self.bodies.get(obstacle.checked_sub(self.bodies_from())?).map(|(_, body)| body)
    }

    fn fields(&self) -> impl Iterator<Item = (&Rectangle, &HeightField)> {
        self.bodies.iter().filter_map(|(rectangle, body)| Some((rectangle, body.height_field()?)))
    }

    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Whether nothing bounds the motion of links and of what they push, fixed obstacles or stops.
    pub fn is_unbounded(&self) -> bool {
        self.is_empty() && !self.has_stops
    }

    /// The disc whose stop has this number; stops are numbered behind the obstacles that are fixed.
    pub fn stop(&self, obstacle: usize) -> Option<&Movable> {
        self.movables.get(obstacle.checked_sub(self.len())?)
    }

    /// The polygon of an obstacle that is not a peg.
    pub fn polygon(&self, obstacle: usize) -> &ConvexPolygon {
        &self.walls.walls()[obstacle - self.pegs.len()].polygon
    }

    /// Number of features that describe a link and the side of an obstacle.
    pub fn features(&self, obstacle: usize) -> usize {
        if obstacle < self.pegs.len() || obstacle >= self.len() { 1 } else { self.polygon(obstacle).features() }
    }

    /// Coulomb coefficient of an obstacle.
    pub fn friction(&self, obstacle: usize) -> f64 {
        self.friction.get(obstacle).copied().unwrap_or(0.0)
    }

    /// The same at a feature; none where links have the friction of the ground.
    pub fn coefficient(&self, obstacle: usize, feature: usize) -> Option<f64> {
        let of_obstacle = self.friction(obstacle);
        self.body(obstacle).map_or(Some(of_obstacle), |body| body.coefficient(feature, of_obstacle))
    }

    /// Height of an obstacle, infinite without end \[m\].
    pub fn top(&self, obstacle: usize) -> f64 {
        self.height.get(obstacle).copied().unwrap_or(f64::INFINITY)
    }

    /// An obstacle of finite height as a body; none without end.
    pub fn solid(&self, obstacle: usize) -> Option<Solid<'_>> {
        let height = self.top(obstacle);
        if height == f64::INFINITY {
            return None;
        }
        let outline = match self.pegs.get(obstacle) {
            Some(peg) => Outline::Circle(peg),
            None => Outline::Polygon(self.polygon(obstacle)),
        };
        Some(Solid { outline, height })
    }

    /// Whether an obstacle has a top face, or is a field.
    pub fn has_top(&self, obstacle: usize) -> bool {
        self.top(obstacle) < f64::INFINITY || self.body(obstacle).is_some_and(|body| body.height_field().is_some())
    }

    /// Calls `visit` with every obstacle of finite height that may lie within `distance` of a point, seen from above.
    pub fn visit_solids(&self, point: &Vector2<f64>, distance: f64, mut visit: impl FnMut(usize, Solid)) {
        if !self.height.is_empty() && self.tops.distance(point) <= distance {
            self.visit_obstacles(point, distance, |obstacle| {
                self.solid(obstacle).into_iter().for_each(|solid| visit(obstacle, solid));
            });
        }
    }

    /// Calls `visit` with the number of every obstacle that may lie within `distance` of a point, seen from above.
    pub fn visit_obstacles(&self, point: &Vector2<f64>, distance: f64, mut visit: impl FnMut(usize)) {
        self.near(point.x, point.y, distance).for_each(&mut visit);
        self.walls.near(*point, distance).for_each(|wall| visit(self.pegs.len() + wall));
        for (number, (rectangle, _)) in self.bodies.iter().enumerate() {
            if rectangle.distance(point) <= distance {
                visit(self.bodies_from() + number);
            }
        }
    }

    /// Whether an obstacle is one of those that [`Self::visit_obstacles`] visits.
    pub fn is_within(&self, obstacle: usize, point: &Vector2<f64>, distance: f64) -> bool {
        match (self.pegs.get(obstacle), obstacle.checked_sub(self.bodies_from())) {
            (Some(peg), _) => is_peg_within(peg, point, distance),
            (None, Some(body)) => self.bodies[body].0.distance(point) <= distance,
            (None, None) => self.walls.walls()[obstacle - self.pegs.len()].rectangle.distance(point) <= distance,
        }
    }

    /// The obstacle with the highest top face below a point, and its height \[m\]; none above the ground. Over a field that
    /// carries links otherwise than the ground does, infinitely low.
    pub fn support(&self, point: &Vector3<f64>) -> Option<(usize, f64)> {
        let mut highest = self.field_below(&point.xy());
        self.visit_solids(&point.xy(), 0.0, |obstacle, solid| {
            if solid.carries(point) && highest.is_none_or(|(_, height)| height < solid.height) {
                highest = Some((obstacle, solid.height));
            }
        });
        highest
    }

    /// The first field at a point, and what [`HeightField::ground_below`] says of it.
    fn field_below(&self, point: &Vector2<f64>) -> Option<(usize, f64)> {
        let fields = self.bodies.iter().enumerate();
        let below = |(number, (_, body)): (usize, &(_, Body))| {
            Some((self.bodies_from() + number, body.height_field()?.ground_below(point)?))
        };
        fields.filter_map(below).next()
    }

    /// Height at which the ground's own law holds on a field, see [`HeightField::ground_below`]; none beside fields \[m\].
    pub fn field_ground(&self, point: &Vector2<f64>) -> Option<f64> {
        self.field_below(point).map(|(_, height)| height)
    }

    /// Height of the ground at a point: of the first field there, or else of the plane \[m\].
    pub fn ground_height(&self, point: &Vector2<f64>) -> f64 {
        self.fields().find_map(|(_, field)| field.height_at(point)).unwrap_or(0.0)
    }

    /// Index of an obstacle in the scene.
    pub fn index_in_scene(&self, obstacle: usize) -> usize {
        self.index_in_scene.get(obstacle).copied().unwrap_or(obstacle)
    }

    pub fn pegs(&self) -> &[Peg] {
        &self.pegs
    }

    /// Replaces all obstacles by pegs without friction.
    pub fn rebuild(&mut self, pegs: &[Peg]) {
        self.movables.clear();
        self.has_stops = false;
        if self.len() > self.pegs.len() {
            self.walls = WallGrid::default();
            self.bodies.clear();
        }
        self.friction.clear();
        self.height.clear();
        self.tops = Rectangle::default();
        self.index_in_scene.clear();
        self.written.clear();
        self.pegs.clear();
        self.pegs.extend_from_slice(pegs);
        self.largest_radius = pegs.iter().fold(0.0, |largest, peg| largest.max(peg.radius));
        self.lay_out_cells();
        self.sort_into_cells();
    }

    /// A distance that every point within `extent` of `centre` may move without touching an obstacle, not necessarily the
    /// largest; zero unless all obstacles lie outside that circle \[m\].
    pub fn clear_way(&self, centre: &Vector2<f64>, extent: f64) -> f64 {
        let mut clear = extent;
        // No extent: the poses of the robot are not numbers.
        while clear > 0.0 && clear < FARTHEST && self.is_clear(centre.x, centre.y, 2.0 * clear) {
            clear *= 2.0;
        }
        clear - extent
    }

    /// Whether all pegs are farther than `distance` from `(x, y)`, and the rectangles around all walls.
    pub fn is_clear(&self, x: f64, y: f64, distance: f64) -> bool {
        let point = Vector2::new(x, y);
        self.near(x, y, distance).next().is_none()
            && self.walls.near(point, distance).next().is_none()
            && self.bodies.iter().all(|(rectangle, _)| rectangle.distance(&point) > distance)
    }

    /// The pegs whose rim lies within `distance` of `(x, y)`, by number.
    pub fn near(&self, x: f64, y: f64, distance: f64) -> impl Iterator<Item = usize> {
        let is_near = move |&peg: &usize| is_peg_within(&self.pegs[peg], &Vector2::new(x, y), distance);
        self.cells_near(x, y, distance).flatten().map(|&peg| peg as usize).filter(is_near)
    }

    /// The pegs in the cells that a square around `(x, y)` meets, one row of cells after the other: all whose rim lies
    /// within `distance`, and others.
    fn cells_near(&self, x: f64, y: f64, distance: f64) -> impl Iterator<Item = &[u32]> {
        let reach = distance + self.largest_radius;
        let (first_column, last_column) = self.cells_between(x - reach, x + reach, 0, self.columns);
        let (first_row, last_row) = self.cells_between(y - reach, y + reach, 1, self.rows);
        let rows = if first_column < last_column { first_row..last_row } else { 0..0 };
        rows.map(move |row| {
            let first = row * self.columns;
            let pegs = self.start[first + first_column] as usize..self.start[first + last_column] as usize;
            &self.order[pegs]
        })
    }

    /// Cells of about two peg diameters, but never many more cells than pegs.
    fn lay_out_cells(&mut self) {
        let (mut low, mut high) = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
        for peg in &self.pegs {
            for (axis, value) in [peg.x, peg.y].into_iter().enumerate() {
                low[axis] = low[axis].min(value);
                high[axis] = high[axis].max(value);
            }
        }
        if self.pegs.is_empty() {
            (low, high) = ([0.0; 2], [0.0; 2]);
        }
        let size = [high[0] - low[0], high[1] - low[1]];
        let cell_per_peg = (size[0] * size[1] / (self.pegs.len() + 1) as f64).sqrt();
        let longest = size[0].max(size[1]) / (self.pegs.len() + 1) as f64;
        self.cell = MIN_CELL.max(2.0 * self.largest_radius).max(cell_per_peg).max(longest);
        self.origin = low;
        self.columns = (size[0] / self.cell) as usize + 1;
        self.rows = (size[1] / self.cell) as usize + 1;
    }

    fn sort_into_cells(&mut self) {
        self.start.clear();
        self.start.resize(self.columns * self.rows + 1, 0);
        for index in 0..self.pegs.len() {
            let cell = self.cell_of(&self.pegs[index]);
            self.start[cell + 1] += 1;
        }
        for cell in 1..self.start.len() {
            self.start[cell] += self.start[cell - 1];
        }
        self.order.clear();
        self.order.resize(self.pegs.len(), 0);
        // Filling shifts every start to its end; the shift is undone below.
        for index in 0..self.pegs.len() {
            let cell = self.cell_of(&self.pegs[index]);
            self.order[self.start[cell] as usize] = index as u32;
            self.start[cell] += 1;
        }
        self.start.rotate_right(1);
        self.start[0] = 0;
    }

    fn cell_of(&self, peg: &Peg) -> usize {
        let column = ((peg.x - self.origin[0]) / self.cell) as usize;
        let row = ((peg.y - self.origin[1]) / self.cell) as usize;
        row.min(self.rows - 1) * self.columns + column.min(self.columns - 1)
    }

    /// Half-open range of cells along `axis` that meet `[low, high]`.
    fn cells_between(&self, low: f64, high: f64, axis: usize, count: usize) -> (usize, usize) {
        let index = |value: f64| (value - self.origin[axis]) / self.cell;
        // The conversion truncates, which is the floor of what is not negative.
        let first = index(low).max(0.0) as usize;
        let last = (index(high) + 1.0).clamp(0.0, count as f64) as usize;
        (first.min(last), last)
    }
}

/// Whether a peg's rim lies within `distance` of a point.
fn is_peg_within(peg: &Peg, point: &Vector2<f64>, distance: f64) -> bool {
    let (dx, dy, reach) = (peg.x - point.x, peg.y - point.y, distance + peg.radius);
    dx * dx + dy * dy <= reach * reach
}

/// Smallest cell \[m\].
const MIN_CELL: f64 = 0.1;

#[cfg(test)]
mod tests {
    use super::*;

    fn scattered(count: usize) -> Vec<Peg> {
        let fraction = |k: f64| (k * 0.618_033_988_75).fract();
        (0..count)
            .map(|i| {
                let k = i as f64;
                Peg { radius: 0.01 + 0.1 * fraction(k), x: 7.0 * fraction(3.0 * k) - 2.0, y: 5.0 * fraction(7.0 * k) }
            })
            .collect()
    }

    #[test]
    fn finds_exactly_what_a_full_search_finds() {
        for count in [0, 1, 2, 50, 700] {
            let pegs = scattered(count);
            let grid = ObstacleGrid::new(&pegs);
            for k in 0..200 {
                let (x, y, d) = (f64::from(k) * 0.06 - 4.0, f64::from(k % 17) * 0.4 - 1.0, 0.02 * f64::from(k % 23));
                let near = |peg: &Peg| (peg.x - x).hypot(peg.y - y) - peg.radius <= d;
                let mut found: Vec<usize> = grid.near(x, y, d).collect();
                found.sort_unstable();
                let all: Vec<usize> = (0..count).filter(|&peg| near(&pegs[peg])).collect();
                assert_eq!(found, all);
                assert_eq!(grid.is_clear(x, y, d), all.is_empty());
            }
        }
    }

    #[test]
    fn cells_stay_in_proportion_to_the_pegs_however_far_they_lie() {
        let grid = ObstacleGrid::new(&[[0.01, -1e6, 0.0].into(), [0.01, 1e6, 1.0].into(), [0.01, 0.0, 1e6].into()]);
        assert!(grid.start.len() < 100, "{} cells for 3 pegs", grid.start.len());
    }
}
