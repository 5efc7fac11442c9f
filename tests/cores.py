"""A door to the core's arrays, for what no scene file can ask for."""

from chutelab import core as module
from chutelab.engines import contact as engine
from chutelab.results.recorder import Recorder


class Core:
    """A run at the level of arrays: change them, then `run` or `step`.

    Parameters
    ----------
    machine : Machine
    rooms : dict, optional
        Rooms that are smaller than what the engine would make at first.
    """

    def __init__(self, machine, rooms=None):
        self.machine = machine
        self.module = module.Module()
        self.job = engine.Job(self.module, machine)
        for name, size in (rooms or {}).items():
            setattr(self.module.world, f"{name}_room", size)

    def _array(self, name, struct, count):
        return self.module.array(name, module.dtype(struct), count)

    @property
    def disks(self):
        return self._array("disks", "Disk", self.machine.count)

    @property
    def surfaces(self):
        return self._array("surfaces", "Surface", self.world.surface_count)

    @property
    def pairs(self):
        """Disk against disk, then against each surface, as long as there is one kind of disk."""
        return self._array("pairs", "Pair", 1 + self.job.materials)

    @property
    def contacts(self):
        """Lasting contacts of the latest step."""
        return self._array("earlier", "Contact", self.world.earlier_count)

    @property
    def world(self):
        return self.module.world

    def run(self):
        """Run to the end and return the recording; a stall is an error."""
        stalled = self.job.run(None)
        assert stalled is None, str(stalled)
        return self.recording()

    def recording(self):
        recorder = Recorder(self.machine)
        self.job.write(recorder)
        return recorder.finish(engine="contact", steps=self.world.step_count)

    def step(self, steps=1):
        """Run on for some steps, making room where it is full; True at the end of the run."""
        while True:
            status = self.job.proceed(steps)
            assert status is not module.Status.STALLED
            if status in (module.Status.DONE, module.Status.PAUSED):
                return status is module.Status.DONE


def modes(core):
    """Return how many disks are in each mode, by name."""
    names = module.constants("Mode")
    return {name: int((core.disks["mode"] == value).sum()) for name, value in names.items()}
