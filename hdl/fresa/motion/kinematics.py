"""From steps of axes to steps of motors, and back from where motors are to where axes are."""

from amaranth import Cat, Module, Mux, Signal, signed
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

from ..arithmetic.line import WIDTH

__all__ = ["KINEMATICS", "CoreXY"]

AXES = 3


class Kinematics(wiring.Component):
    """What lies between the steps of three axes and those of three motors.

    Members
    -------
    step, direction : In(3)
        Steps of axes, and their directions, 1 to higher positions.
    motor_step, motor_direction : Out(3)
        Steps of motors.
    busy : Out(1)
        A step of a motor is still to come.
    motors, positions : In(signed(36)) x 3, Out(signed(36)) x 3
        Positions of motors, and those of axes, in steps. While a step is under way they may be off
        by one.
    shift : In(signed(36)) x 3
        By how much positions of axes are to become other ones.
    motor_shift : Out(signed(36)) x 3
        By how much those of motors are to.
    """

    step: In(AXES)
    direction: In(AXES)
    motor_step: Out(AXES)
    motor_direction: Out(AXES)
    busy: Out(1)
    motors: In(signed(WIDTH)).array(AXES)
    positions: Out(signed(WIDTH)).array(AXES)
    shift: In(signed(WIDTH)).array(AXES)
    motor_shift: Out(signed(WIDTH)).array(AXES)


class Cartesian(Kinematics):
    """A motor for each axis."""

    def elaborate(self, platform) -> Module:
        m = Module()
        m.d.comb += [self.motor_step.eq(self.step), self.motor_direction.eq(self.direction)]
        for axis in range(AXES):
            m.d.comb += [self.positions[axis].eq(self.motors[axis]),
                         self.motor_shift[axis].eq(self.shift[axis])]
        return m


class CoreXY(Kinematics):
    """Two motors that stand still move X and Y by belts: A = X + Y, B = X - Y; and one moves Z.

    X and Y have as many steps per mm as each other. A step of Y in the clock of one of X is made a
    clock later, so that a motor makes one step in a clock: it may not be followed by another step
    of Y in that clock. The sums of A and B, and their difference, are even at rest.
    """

    def elaborate(self, platform) -> Module:
        m = Module()
        x, y = self.step[0], self.step[1]
        late, late_direction = Signal(), Signal()
        steps_y, forward_y = Signal(), Signal()
        m.d.sync += [late.eq(x & (y | late)),
                     late_direction.eq(Mux(y, self.direction[1], late_direction))]
        m.d.comb += [
            steps_y.eq((y | late) & ~x), forward_y.eq(Mux(late, late_direction, self.direction[1])),
            self.motor_step.eq(Cat((x | steps_y).replicate(2), self.step[2])),
            self.motor_direction.eq(Cat(Mux(x, self.direction[0], forward_y),
                                        Mux(x, self.direction[0], ~forward_y),
                                        self.direction[2])),
            self.busy.eq(late),
        ]
        a, b, z = self.motors
        m.d.comb += [
            self.positions[0].eq((a + b) >> 1), self.positions[1].eq((a - b) >> 1),
            self.positions[2].eq(z),
            self.motor_shift[0].eq(self.shift[0] + self.shift[1]),
            self.motor_shift[1].eq(self.shift[0] - self.shift[1]),
            self.motor_shift[2].eq(self.shift[2]),
        ]
        return m


KINEMATICS: dict[str, type[Kinematics]] = {"cartesian": Cartesian, "corexy": CoreXY}
"""By the names of an option."""
