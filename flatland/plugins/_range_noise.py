"""Parameters of the noise models of range finders."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from flatland.physics import RangeNoise
from flatland.plugin_api.parameters import read_not_negative

if TYPE_CHECKING:
    from flatland.config.reader import YamlReader

NOISE_MODELS: Final = ("additive", "proportional", "beam")
SHARE_TOLERANCE: Final = 1e-6  # by which the sum of the shares may differ from 1
BEAM_KEYS: Final = ("z_hit", "z_short", "z_max", "z_rand", "sigma_hit", "lambda_short")
MAX_DEVIATION: Final = 1e6  # m; the greatest range of a laser
MAX_LAMBDA: Final = 1e6  # 1/m; a mean of one micrometre


def read_range_noise(config: YamlReader, max_range: float) -> RangeNoise | None:
    """Reads the parameters of the noise of a range finder.

    Args:
        config: Parameters of the plugin.
        max_range: Maximum range of the sensor [m].

    Returns:
        The model, None for no noise.

    Raises:
        YamlError: A parameter is invalid, or belongs to another model.
    """
    name: str = config.get("noise_model", "string", "additive")
    if name not in NOISE_MODELS:
        raise config.invalid(
            "noise_model", f"must be one of: {', '.join(NOISE_MODELS)}, got {name}"
        )
    if name == "beam":
        if "noise_std_dev" in config:
            raise config.invalid("noise_std_dev", "not used by the noise model beam: use sigma_hit")
        return _read_beam_model(config, max_range)
    for key in BEAM_KEYS:
        if key in config:
            raise config.invalid(key, 'only used with "noise_model: beam"')
    is_proportional = name == "proportional"
    deviation = read_not_negative(config, "noise_std_dev", 0.0)
    limit, unit = (1.0, "times the range") if is_proportional else (MAX_DEVIATION, "m")
    if deviation > limit:
        raise config.invalid("noise_std_dev", f"must be at most {limit:g} {unit}, got {deviation}")
    if not deviation:
        return None
    return RangeNoise.proportional(deviation) if is_proportional else RangeNoise.additive(deviation)


def _read_beam_model(config: YamlReader, max_range: float) -> RangeNoise:
    short, missed, random = (
        config.get(key, "float", 0.0, minimum=0, maximum=1)
        for key in ("z_short", "z_max", "z_rand")
    )
    rest = 1.0 - (short + missed + random)
    hit: float = config.get("z_hit", "float", max(0.0, rest), minimum=0, maximum=1)
    if abs(hit - rest) > SHARE_TOLERANCE:
        raise config.invalid(
            "z_hit",
            "z_hit + z_short + z_max + z_rand must be 1, "
            f"got {hit:g} + {short:g} + {missed:g} + {random:g} = {hit + 1.0 - rest:.9g}",
        )
    sigma = config.get("sigma_hit", "float", 0.0, minimum=0)
    if sigma > max_range:
        raise config.invalid(
            "sigma_hit", f'must be at most the "range", {max_range:g} m, got {sigma}'
        )
    if short and "lambda_short" not in config:
        raise config.invalid("z_short", 'requires "lambda_short"')
    rate = config.get("lambda_short", "float", 1.0)
    if not 0 < rate <= MAX_LAMBDA:
        raise config.invalid(
            "lambda_short", f"must be greater than 0 and at most {MAX_LAMBDA:g} 1/m, got {rate}"
        )
    return RangeNoise.beam(
        z_hit=hit,
        z_short=short,
        z_max=missed,
        z_rand=random,
        sigma_hit=sigma,
        lambda_short=rate,
        max_range=max_range,
    )
