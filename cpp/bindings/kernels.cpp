// The kernels, compiled once for all units of the extension.
#define SDNN_KERNELS_HERE

#include "sdnn/approximators/detail/activation_cache.hpp"
#include "sdnn/approximators/detail/column_sums.hpp"
#include "sdnn/approximators/detail/linear_rows.hpp"
#include "sdnn/approximators/detail/window_counts.hpp"
#include "sdnn/approximators/error_correction.hpp"
#include "sdnn/coding/detail/ternary_code.hpp"
#include "sdnn/coding/selective_desensitization.hpp"
#include "sdnn/environments/detail/acrobot_kernel.hpp"
#include "sdnn/estimators/detail/code_walk.hpp"
#include "sdnn/estimators/detail/signed_sums.hpp"
#include "sdnn/estimators/detail/transposition.hpp"
#include "sdnn/estimators/detail/unit_ranking.hpp"
#include "sdnn/estimators/detail/weight_tiles.hpp"
#include "sdnn/estimators/kernel_sums.hpp"
#include "tools/yardsticks.hpp"
