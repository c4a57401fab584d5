from sim.headset.tally import Tally


def test_figures_of_two_processes_are_apart():
    one, other = Tally(), Tally()
    one.indices.add(3)
    one.joins_s.append(0.5)
    one.hand.add(2.0)
    assert (other.indices, other.joins_s, other.hand.count) == (set(), [], 0)
