// Arrays of a simulation that numpy sees without a copy. When the simulation goes on, what numpy still holds keeps the memory, and the
// simulation gets a copy: memory that numpy can see is never freed or changed by a step.
#pragma once

#include "base/array.hpp"

#include <pybind11/numpy.h>

#include <memory>
#include <utility>
#include <vector>

namespace ordo::python {

namespace py = pybind11;

/// The exports of one array of n elements.
template <class T>
class Export {
  public:
    explicit Export(Array<T>& array) : array_(&array) {}

    /// A numpy array of this shape and strides (bytes) on the memory of the array.
    template <class Number>
    py::array numpy(std::vector<py::ssize_t> shape, std::vector<py::ssize_t> strides, bool is_writable)
    {
        std::shared_ptr<Array<T>> kept = kept_.lock();
        if (!kept) kept_ = kept = std::make_shared<Array<T>>();
        auto* const owner = new std::shared_ptr<Array<T>>(kept);
        const py::capsule base(owner, [](void* p) { delete static_cast<std::shared_ptr<Array<T>>*>(p); });
        static Number none{};
        py::array r(py::dtype::of<Number>(), std::move(shape), std::move(strides),
                    array_->empty() ? &none : reinterpret_cast<Number*>(array_->data()), base);
        if (!is_writable) r.attr("setflags")(py::arg("write") = false);
        return r;
    }

    /// Leaves the memory to numpy, if it still sees it. The simulation goes on with a copy.
    void release()
    {
        const std::shared_ptr<Array<T>> kept = std::exchange(kept_, {}).lock();
        if (!kept) return;
        Array<T> own;
        copy(own, *array_);
        *kept   = std::move(*array_);
        *array_ = std::move(own);
    }

    /// Leaves the memory to numpy at the end of the simulation.
    void leave()
    {
        if (const std::shared_ptr<Array<T>> kept = kept_.lock()) *kept = std::move(*array_);
    }

  private:
    Array<T>* array_;
    std::weak_ptr<Array<T>> kept_;
};

}  // namespace ordo::python
