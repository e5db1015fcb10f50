"""The rows of the study as data: which trainings, of how many samples, scored on which test sets."""

from dataclasses import asdict, dataclass, replace

# The methods' names, and what the trainer calls the network that is trained on pairs.
METHODS = {"latent diffusion": "generator", "VQ-VAE": "vqvae", "L1 UNet": "l1unet", "VisGel": "visgel"}
CONDITIONS = ("plain", "ambiguous", "mixed", "misaligned", "noise")
# A latent diffusion is two networks. Of its samples so many are imprints for the autoencoder, the same for every budget, so
# that budgets can share a generator; the rest are pairs for the generator. Other methods are given pairs alone.
AUTOENCODER = 2000
# Ways from what the network draws to meters: undone exactly, the paper's shift, and neither ("without shift").
SHIFTS = ("exact", "paper", "raw")
# Pairs of another sensor that a model is fitted to, and steps of tuning.
FITS = ((10, 0), (36, 0), (10, 50), (36, 50))


@dataclass(frozen=True)
class Training:
    """All that decides a network's weights but the number of samples and what all trainings have in common."""

    method: str = "latent diffusion"
    condition: str = "plain"
    rotation: bool = True
    flip: bool = True
    geometry: str = "full"

    def name(self):
        switches = [name for name in ("rotation", "flip") if not getattr(self, name)]
        parts = [self.method, self.condition, *(f"no {s}" for s in switches), self.geometry]
        return "_".join(parts).replace(" ", "-").lower()


@dataclass(frozen=True)
class Row:
    """A row of the table: a training (`None`: the shipped generator) after `samples` samples, scored on a test set."""

    training: Training | None
    samples: int | None
    test: str = "test-set"
    shift: str = "exact"
    # Pairs of the other sensor and steps of tuning.
    fit: tuple[int, int] | None = None

    def settings(self):
        training = asdict(self.training) if self.training else {"method": "shipped generator"}
        return training | {"samples": self.samples, "test": self.test, "shift": self.shift, "fit": list(self.fit or ())}


# Settings that a row is compared with, by the one in which it differs. Of samples, every number is compared with every other.
REFERENCE = {key: value for key, value in Row(Training(), None).settings().items() if key not in ("samples", "test")}


def test_set(condition):
    return "test-set" if condition == "plain" else f"test-set-{condition}"


def methods(budgets, _equal):
    """Each method at each budget; the diffusion also by the other ways to meters; beside them what ships."""
    yield Row(None, None)
    for budget in sorted(budgets):
        for shift in SHIFTS:
            yield Row(Training(), budget, shift=shift)
        for method in list(METHODS)[1:]:
            yield Row(Training(method), budget)


def conditions(_budgets, equal):
    """A diffusion trained under each condition, on the test set of each: its own first."""
    for condition in CONDITIONS:
        for test in (condition, *(c for c in CONDITIONS if c != condition)):
            yield Row(Training(condition=condition), equal, test_set(test))


def ablations(_budgets, equal):
    """Turning, mirroring and both (the paper's choice), neither; and the other two geometries, with both."""
    both = Training()
    runs = (both, replace(both, flip=False), replace(both, rotation=False), replace(both, rotation=False, flip=False),
            replace(both, geometry="padding"), replace(both, geometry="cropping"))
    for test in CONDITIONS:
        for training in runs:
            yield Row(training, equal, test_set(test))


def adapted(budgets, _equal):
    """The methods on another pair of sensors and on other GelSlims, as they are and fitted to pairs of these."""
    for test in ("other-sensors", "other-gelslims"):
        for training in (None, *map(Training, METHODS)):
            samples = max(budgets) if training else None
            tunable = training is None or training.method == "latent diffusion"
            for fit in (None, *(fit for fit in FITS if tunable or not fit[1])):
                yield Row(training, samples, test, fit=fit)


SECTIONS = {"methods": methods, "conditions": conditions, "ablations": ablations, "adapted": adapted}
