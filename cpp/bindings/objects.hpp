/// Checks of Python's objects before a call uses them: they must be initialized, and no call in
/// another thread may be changing them.
#pragma once

#include <pybind11/pybind11.h>

#include <algorithm>
#include <chrono>
#include <cstddef>
#include <functional>
#include <memory>
#include <span>
#include <stdexcept>
#include <string>
#include <thread>
#include <type_traits>
#include <utility>
#include <vector>

// This function marks the namespaces of the library: argument-dependent lookup finds it for their
// classes. It is declared once and imported into each namespace, so that lookup is not ambiguous
// for templates whose arguments are of several namespaces.
namespace sdnn::library {
void is_of_library(const void*);
}
namespace sdnn::agents {
using library::is_of_library;
}
namespace sdnn::approximators {
using library::is_of_library;
}
namespace sdnn::coding {
using library::is_of_library;
}
namespace sdnn::environments {
using library::is_of_library;
}
namespace sdnn::estimators {
using library::is_of_library;
}
namespace sdnn::tools {
using library::is_of_library;
}

namespace sdnn::bindings {

/// Whether `T` is a template over other types, such as a container. Bound templates of the library
/// need a specialization that is false.
template <class T>
inline constexpr bool kIsComposed = false;
template <template <class...> class Template, class... Types>
inline constexpr bool kIsComposed<Template<Types...>> = true;

/// Classes of the namespaces above, whose arguments are checked.
template <class T>
concept LibraryClass =
    std::is_class_v<T> && !kIsComposed<T> && requires(T* object) { is_of_library(object); };

/// A class of the library in Python. Others do not compile: their objects would not be checked.
template <LibraryClass T, class... Options>
using Class = pybind11::class_<T, Options...>;

/// Memory that a call reads or changes without the GIL. The GIL guards the list of them.
struct Use {
  const void* owner;
  const std::byte* begin;
  const std::byte* end;
  bool changes;

  /// Describes the use of an object with its members; const ones are not changed.
  template <class Object>
  static Use of(const void* owner, Object& object) noexcept {
    const auto* const begin = reinterpret_cast<const std::byte*>(&object);
    return {owner, begin, begin + sizeof(Object), !std::is_const_v<Object>};
  }

  /// Describes the use of parts that an object holds elsewhere.
  template <class Part>
  static Use of(const void* owner, const std::span<Part>& parts) noexcept {
    const auto bytes = std::as_bytes(parts);
    return {owner, bytes.data(), bytes.data() + bytes.size(), !std::is_const_v<Part>};
  }

  static std::vector<Use>& all() {
    static std::vector<Use> uses;
    return uses;
  }

  bool overlaps(const Use& other) const noexcept {
    return std::less<>()(begin, other.end) && std::less<>()(other.begin, end);
  }
};

/// Throws std::runtime_error if another call is changing the memory, or is using it while this call
/// wants to change it.
inline void require_unused(const Use& wanted, const char* name) {
  for (const Use& use : Use::all()) {
    if ((use.changes || wanted.changes) && use.overlaps(wanted)) {
      throw std::runtime_error(std::string("this ") + name +
                               " is in use by a call in another thread: wait for its end");
    }
  }
}

/// Releases the GIL like pybind11's gil_scoped_release, but is safe at the end of the interpreter.
/// Before 3.14, Python then ends threads that request the GIL by unwinding their stacks, which
/// calls std::terminate in frames of C++. Here such a thread waits for the end of the process
/// instead.
class ReleasedGIL {
 public:
  ReleasedGIL() : state_(PyEval_SaveThread()) {}
  ReleasedGIL(const ReleasedGIL&) = delete;
  ReleasedGIL& operator=(const ReleasedGIL&) = delete;
  ~ReleasedGIL() {
    try {
      PyEval_RestoreThread(state_);
    } catch (...) {
      for (;;) std::this_thread::sleep_for(std::chrono::hours(1));
    }
  }

 private:
  PyThreadState* state_;
};

/// Releases the GIL while a call works on objects, so that other threads can run Python.
///
/// Objects passed as const are read, others are changed, including everything stored in them.
/// During its lifetime any use of a changing object, and any change of an object that is being
/// read, raises a RuntimeError. Arrays must be copied before: nothing prevents other threads from
/// changing them.
class WithoutGIL {
 public:
  /// Throws std::runtime_error if another thread's call is in the way.
  template <class... Object>
  explicit WithoutGIL(Object&... objects) : uses_(this, {Use::of(this, objects)...}) {}
  /// Releases the lock for numbers of objects and parts that are known only at run time.
  template <class Object, class Part>
  WithoutGIL(const std::vector<Object*>& objects, const std::vector<std::span<Part>>& parts)
      : uses_(this, of_all(objects, parts)) {}
  WithoutGIL(const WithoutGIL&) = delete;
  WithoutGIL& operator=(const WithoutGIL&) = delete;

 private:
  /// The uses, by this reader, of whole objects and of arrays inside objects.
  template <class Object, class Part>
  std::vector<Use> of_all(const std::vector<Object*>& objects,
                          const std::vector<std::span<Part>>& parts) const {
    std::vector<Use> uses;
    for (Object* const object : objects) uses.push_back(Use::of(this, *object));
    for (const std::span<Part>& part : parts) uses.push_back(Use::of(this, part));
    return uses;
  }

  struct Uses {
    Uses(const void* owner, const std::vector<Use>& uses) : owner_(owner) {
      for (const Use& use : uses) require_unused(use, "object");
      Use::all().insert(Use::all().end(), uses.begin(), uses.end());
    }
    Uses(const Uses&) = delete;
    Uses& operator=(const Uses&) = delete;
    ~Uses() {
      std::erase_if(Use::all(), [this](const Use& use) { return use.owner == owner_; });
    }

    const void* owner_;
  };

  Uses uses_;
  ReleasedGIL released_;  // last: the GIL is back before the list changes
};

/// Waits until no call in another thread reads the object, so that it can be changed with the GIL
/// held. Use it only for objects that are read for short times.
template <class Object>
void wait_for_readers(Object& object) {
  const auto is_reader = [use = Use::of(nullptr, object)](const Use& other) {
    return !other.changes && other.overlaps(use);
  };
  while (std::ranges::any_of(Use::all(), is_reader)) {
    const ReleasedGIL released;
    std::this_thread::yield();
  }
}

/// Makes pickling raise TypeError for all classes that do not define it. Otherwise, with pickle's
/// protocols 0 and 1, pybind11 would throw a C++ exception through Python's frames.
inline void refuse_pickling() {
  const pybind11::handle base(pybind11::detail::get_internals().instance_base);
  base.attr("__reduce__") = pybind11::cpp_function(
      [](pybind11::handle self) {
        throw pybind11::type_error("cannot pickle a " + std::string(Py_TYPE(self.ptr())->tp_name));
      },
      pybind11::is_method(base));
}

/// Throws TypeError if the object of `held` was never initialized, and std::runtime_error if
/// another thread's call is changing it. pybind11 checks neither: it would allocate uninitialized
/// memory for the former.
inline void require_usable(const pybind11::detail::value_and_holder& held) {
  const auto name = [&held] {
    const pybind11::handle type(reinterpret_cast<PyObject*>(Py_TYPE(held.inst)));
    return pybind11::cast<std::string>(type.attr("__name__"));
  };
  const auto* const object = static_cast<const std::byte*>(held.value_ptr());
  if (object == nullptr) throw pybind11::type_error(name() + ".__init__() was not called");
  if (!Use::all().empty()) require_unused({nullptr, object, object + 1, false}, name().c_str());
}

}  // namespace sdnn::bindings

namespace pybind11::detail {

/// Arguments of the library's classes, `self` among them.
template <sdnn::bindings::LibraryClass T>
class type_caster<T> : public type_caster_base<T> {
 public:
  bool load(handle source, bool convert) {
    return this->template load_impl<type_caster>(source, convert);
  }
  void load_value(value_and_holder&& held) {
    sdnn::bindings::require_usable(held);
    type_caster_base<T>::load_value(std::move(held));
  }
};

template <sdnn::bindings::LibraryClass T>
class type_caster<std::shared_ptr<T>> : public copyable_holder_caster<T, std::shared_ptr<T>> {
 public:
  bool load(handle source, bool convert) {
    if (source.is_none()) return false;  // no function takes a null pointer
    return this->template load_impl<type_caster>(source, convert);
  }

 private:
  friend class type_caster_generic;
  void load_value(value_and_holder&& held) {
    sdnn::bindings::require_usable(held);
    copyable_holder_caster<T, std::shared_ptr<T>>::load_value(std::move(held));
  }
};

}  // namespace pybind11::detail
