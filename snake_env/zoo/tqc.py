"""Hyperparameters for TQC."""

from snake_env.zoo._common import for_all_environments
from snake_env.zoo.sac import hyperparams as sac

_shared = {key: value for key, value in sac["SnakeField-v1"].items() if key not in ("policy", "vec_env_wrapper")}

hyperparams = for_all_environments(**_shared, top_quantiles_to_drop_per_net=2)
