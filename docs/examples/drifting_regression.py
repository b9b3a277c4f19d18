# %% [markdown]
# # Regression, and a stream that drifts
#
# `SDNNRegressor` has scikit-learn's interface. First a sample that stays as it is: two inputs, a
# smooth function, some noise.

# %%
import matplotlib.pyplot as plt
import numpy as np
from sklearn.datasets import make_moons
from sklearn.model_selection import cross_val_score

from sdnn import SDNNClassifier, SDNNRegressor
from sdnn.coding import RandomInverse

random = np.random.default_rng(1)


def waves(x, phase):
    """The function to learn, for inputs in [0, 1]; the phase shifts its waves."""
    return np.sin(2 * np.pi * (x[:, 0] + phase)) * x[:, 1]


x = random.uniform(size=(1000, 2))
y = waves(x, 0.0) + random.normal(0.0, 0.1, 1000)
model = SDNNRegressor(max_iter=10, random_state=0)
scores = cross_val_score(model, x, y, cv=5)
best = 1 - 0.1**2 / y.var()
print(f"R2 in 5-fold cross-validation: {scores.mean():.3f}; noise allows {best:.3f} at most")

# %% [markdown]
# Now samples come in portions of 50, and the function's waves travel: after 100 portions they have
# shifted by half a period. One model learns from the first 20 portions and then stays as it is;
# the other continues with `partial_fit`, one pass over each portion. Both are tested on each
# portion before it is learned. Ranges are given: later samples may exceed those of the first.

# %%
coding = RandomInverse(low=0.0, high=1.0)
fixed = SDNNRegressor(coding, output_range=(-1.5, 1.5), random_state=0)
online = SDNNRegressor(coding, output_range=(-1.5, 1.5), random_state=0)
errors = {"stays as it is": [], "keeps learning": []}
for portion in range(120):
    x = random.uniform(size=(50, 2))
    y = waves(x, 0.5 * max(portion - 20, 0) / 100) + random.normal(0.0, 0.1, 50)
    if portion >= 1:
        for name, model in (("stays as it is", fixed), ("keeps learning", online)):
            errors[name].append(np.sqrt(np.mean((model.predict(x) - y) ** 2)))
    if portion < 20:
        fixed.partial_fit(x, y)
    online.partial_fit(x, y)
for name, error in errors.items():
    before, end = np.mean(error[10:19]), np.mean(error[-20:])
    print(f"{name}: error {before:.2f} before the drift, {end:.2f} at its end")

# %% [markdown]
# The noise alone has a standard deviation of 0.1, which no model can get below. The model that
# keeps learning follows the waves a little behind them; the other one ends with the opposite of
# the truth.

# %%
plt.figure(figsize=(7, 3))
for name, error in errors.items():
    plt.plot(np.arange(1, 120), error, label=name)
plt.axvline(20, color="0.7", linestyle=":")
plt.axhline(0.1, color="0.7", label="noise")
plt.xlabel("portions of 50 samples")
plt.ylabel("error (root mean square)")
plt.legend()
plt.tight_layout()
plt.show()

# %% [markdown]
# Last, how long to train. `n_corrected_` counts the samples that each epoch corrected: with classes
# that hardly overlap the count falls to zero, and training stops by itself; with classes that do it
# levels off, and further epochs learn the noise.

# %%
plt.figure(figsize=(7, 3))
for noise in (0.05, 0.3):
    points, labels = make_moons(500, noise=noise, random_state=0)
    classifier = SDNNClassifier(random_state=0).fit(points, labels)
    epochs = np.arange(1, classifier.n_iter_ + 1)
    plt.plot(epochs, classifier.n_corrected_, label=f"two moons, noise {noise}")
plt.ylim(0, None)
plt.xlabel("epoch")
plt.ylabel("samples corrected")
plt.legend()
plt.tight_layout()
plt.show()
