"""Recovery of state machines from codes that none of their states uses."""

from amaranth import Const, Module, Value

__all__ = ["leave_unused_codes"]


def leave_unused_codes(m: Module, fsm, *, fault: str) -> Value:
    """Send `fsm` to its state `fault` from every code that no state has, within a clock.

    Amaranth's state machines never leave an unused code, and synthesis tools remove states that
    they find unreachable. So the transition is explicit here, and the register is marked so that
    Yosys (``fsm_encoding``) and XST (``fsm_extract``) keep its encoding.

    Call it after the last state of `fsm` is described.

    Parameters
    ----------
    m : Module
        Module in which `fsm` was made.
    fsm : FSM
        What ``with m.FSM() as fsm`` gave.
    fault : str
        Name of the state to go to. It shows an error and stays until reset.

    Returns
    -------
    Value
        1 from the clock in which the register holds an unused code, until reset.
    """
    fsm.state.attrs.update(fsm_encoding="none", fsm_extract="no")
    last = max(fsm.encoding.values())
    upset = fsm.state > last if last + 1 < 1 << len(fsm.state) else Const(0)
    with m.If(upset):
        m.d.sync += fsm.state.eq(fsm.encoding[fault])
    return upset | fsm.ongoing(fault)
