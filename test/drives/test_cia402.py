import pytest

from tri_glide_kinematics.drives import DriveState, bus_load, state_of

WORDS = {
    0x00: DriveState.NOT_READY_TO_SWITCH_ON,
    0x40: DriveState.SWITCH_ON_DISABLED,
    0x21: DriveState.READY_TO_SWITCH_ON,
    0x23: DriveState.SWITCHED_ON,
    0x27: DriveState.OPERATION_ENABLED,
    0x07: DriveState.QUICK_STOP_ACTIVE,
    0x0F: DriveState.FAULT_REACTION_ACTIVE,
    0x08: DriveState.FAULT,
}


def test_bits_of_the_maker_change_no_state():
    for word, state in WORDS.items():
        for others in range(0, 0x10000, 0x80):
            for voltage in (0, 0x10):
                assert state_of(word | others | voltage) is state
    # The bit for a quick stop says nothing in these states.
    for word in (0x00, 0x40, 0x0F, 0x08):
        assert state_of(word | 0x20) is WORDS[word]


def test_load_of_the_bus():
    assert bus_load(1_000_000, 0.002) == pytest.approx(0.3725)
    assert bus_load(500_000, 0.002) == pytest.approx(0.745)
    assert bus_load(1_000_000, 0.002, sends_velocity=True) == pytest.approx(0.515)
