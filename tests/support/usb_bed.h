#pragma once

#include <linux/usbdevice_fs.h>
#include <sys/ioctl.h>
#include <sys/stat.h>
#include <umockdev.h>

#include <algorithm>
#include <atomic>
#include <deque>
#include <functional>
#include <mutex>
#include <stdexcept>
#include <string>

#include "haptics/device/transport/fake_transport.h"
#include "tests/support/with_umockdev.h"

// A Falcon's model on the USB of a kernel that umockdev imitates: sysfs, the device's node and its
// requests, for this process and for programs that it starts. libusb takes it for a device.
namespace palpate::haptics {

class UsbBed {
 public:
    static constexpr const char* kNode = "/dev/bus/usb/001/004";

    // `now_ns` is the time of the model; asked at every request.
    UsbBed(FakePeer& peer, std::function<int64_t()> now_ns)
        : peer_(peer), now_ns_(std::move(now_ns)), bed_(umockdev_testbed_new()) {
        handler_ = umockdev_ioctl_base_new();
        g_signal_connect(handler_, "handle-ioctl", G_CALLBACK(on_ioctl), this);
        plug(4);
    }
    ~UsbBed() {
        umockdev_testbed_detach_ioctl(bed_, node_.c_str(), nullptr);
        forget();
        g_object_unref(handler_);
        g_object_unref(bed_);
    }

    // At this address of the bus, kNode's being 4; not while it is plugged in.
    void plug(int address) {
        if (!node_.empty())
            umockdev_testbed_detach_ioctl(bed_, node_.c_str(), nullptr);
        node_ = "/dev/bus/usb/001/00" + std::to_string(address);
        // A full-speed device of one configuration, one vendor interface and two bulk endpoints.
        const std::string descriptors =
            "1201000200000040030448CB000401020301" // vendor 0403, product cb48
            "09022000010100802D"
            "0904000002FFFFFF00"
            "07058102400000"
            "07050202400000";
        const std::string device =
            "P: /devices/pci0000:00/0000:00:14.0/usb1/1-4\n"
            "N: bus/usb/001/00" +
            std::to_string(address) + "=" + descriptors +
            "\n"
            "E: DEVNAME=" +
            node_ +
            "\n"
            "E: DEVTYPE=usb_device\n"
            "E: SUBSYSTEM=usb\n"
            "E: BUSNUM=001\n"
            "E: DEVNUM=00" +
            std::to_string(address) +
            "\n"
            "A: busnum=1\\n\n"
            "A: devnum=" +
            std::to_string(address) +
            "\\n\n"
            "A: speed=12\\n\n"
            "A: bConfigurationValue=1\\n\n"
            "A: idVendor=0403\\n\n"
            "A: idProduct=cb48\\n\n"
            "H: descriptors=" +
            descriptors + "\n";
        GError* error = nullptr;
        if (!umockdev_testbed_attach_ioctl(bed_, node_.c_str(), handler_, &error) ||
            !umockdev_testbed_add_from_string(bed_, device.c_str(), &error))
            throw std::runtime_error(error ? error->message : "umockdev");
        address_ = static_cast<unsigned>(address);
    }

    // Whoever looks at the model holds it.
    std::unique_lock<std::mutex> hold() { return std::unique_lock(mutex_); }

    std::atomic<int> claim_error = 0, submit_error = 0;
    std::atomic<bool> is_unplugged = false;
    std::atomic<uint64_t> controls = 0, reads = 0, writes = 0;

    // Its node is there and may not be opened.
    void forbid() {
        gchar* const root = umockdev_testbed_get_root_dir(bed_);
        ::chmod(root, 0777); // sockets of umockdev's own are made and found there
        ::chmod((std::string(root) + "/ioctl" + node_).c_str(), 0777);
        ::chmod((std::string(root) + node_).c_str(), 0);
        g_free(root);
    }
    // It vanishes from sysfs too.
    void remove() {
        umockdev_testbed_remove_device(bed_, "/sys/devices/pci0000:00/0000:00:14.0/usb1/1-4");
    }

 private:
    static gboolean on_ioctl(UMockdevIoctlBase*, UMockdevIoctlClient* client, gpointer bed) {
        return static_cast<UsbBed*>(bed)->answer(client);
    }
    // The caller's structure that the argument of a request points to.
    template <class T>
    static T& argument(UMockdevIoctlClient* client) {
        UMockdevIoctlData* const data = umockdev_ioctl_data_resolve(
            umockdev_ioctl_client_get_arg(client), 0, sizeof(T), nullptr);
        T& value = *reinterpret_cast<T*>(data->data);
        umockdev_ioctl_data_unref(data); // the argument keeps it
        return value;
    }
    static usbdevfs_urb& urb_of(UMockdevIoctlData* data) {
        return *reinterpret_cast<usbdevfs_urb*>(data->data);
    }

    gboolean answer(UMockdevIoctlClient* client) {
        const std::lock_guard lock(mutex_);
        const auto end = [&](int error) {
            umockdev_ioctl_client_complete(client, error ? -1 : 0, error);
            return TRUE;
        };
        if (is_unplugged)
            return end(ENODEV);
        UMockdevIoctlData* const first = umockdev_ioctl_client_get_arg(client);
        switch (umockdev_ioctl_client_get_request(client)) {
            case USBDEVFS_CONNECTINFO:
                argument<usbdevfs_connectinfo>(client) = {.devnum = address_, .slow = 0};
                return end(0);
            case USBDEVFS_GET_CAPABILITIES:
                argument<uint32_t>(client) = USBDEVFS_CAP_REAP_AFTER_DISCONNECT;
                return end(0);
            case USBDEVFS_CONTROL: { // which configuration is active
                const auto& asked = argument<usbdevfs_ctrltransfer>(client);
                if (asked.bRequestType != 0x80 || asked.bRequest != 8)
                    return end(EPIPE);
                UMockdevIoctlData* const transfer =
                    umockdev_ioctl_data_resolve(first, 0, sizeof(usbdevfs_ctrltransfer), nullptr);
                UMockdevIoctlData* const bytes = umockdev_ioctl_data_resolve(
                    transfer, offsetof(usbdevfs_ctrltransfer, data), 1, nullptr);
                bytes->data[0] = 1;
                umockdev_ioctl_data_unref(bytes);
                umockdev_ioctl_data_unref(transfer);
                umockdev_ioctl_client_complete(client, 1, 0);
                return TRUE;
            }
            case USBDEVFS_GETDRIVER:
                return end(ENODATA);
            case USBDEVFS_CLAIMINTERFACE:
                forget(); // requests of a descriptor that was closed
                return end(claim_error);
            case USBDEVFS_RELEASEINTERFACE:
                return end(0);
            case USBDEVFS_BULK:
                return halt(client);
            case USBDEVFS_SUBMITURB: {
                if (submit_error)
                    return end(submit_error);
                UMockdevIoctlData* const data =
                    umockdev_ioctl_data_resolve(first, 0, sizeof(usbdevfs_urb), nullptr);
                UMockdevIoctlData* const bytes = umockdev_ioctl_data_resolve(
                    data, offsetof(usbdevfs_urb, buffer),
                    static_cast<gsize>(urb_of(data).buffer_length), nullptr);
                flying_.push_back(data);
                if (bytes)
                    umockdev_ioctl_data_unref(bytes);
                round();
                return end(0);
            }
            case USBDEVFS_REAPURB:
            case USBDEVFS_REAPURBNDELAY: {
                round();
                if (done_.empty())
                    return end(EAGAIN);
                UMockdevIoctlData* const where =
                    umockdev_ioctl_data_resolve(first, 0, sizeof(void*), nullptr);
                umockdev_ioctl_data_set_ptr(where, 0, done_.front());
                umockdev_ioctl_data_unref(where);
                umockdev_ioctl_data_unref(done_.front());
                done_.pop_front();
                return end(0);
            }
            case USBDEVFS_DISCARDURB: {
                const gulong address = *reinterpret_cast<gulong*>(first->data);
                const auto at = std::find_if(flying_.begin(), flying_.end(), [&](auto* data) {
                    return data->client_addr == address;
                });
                if (at == flying_.end())
                    return end(EINVAL);
                urb_of(*at).status = -ENOENT;
                done_.push_back(*at);
                flying_.erase(at);
                return end(0);
            }
            default:
                return end(ENOTTY);
        }
    }

    gboolean halt(UMockdevIoctlClient* client) {
        UMockdevIoctlData* const transfer = umockdev_ioctl_data_resolve(
            umockdev_ioctl_client_get_arg(client), 0, sizeof(usbdevfs_bulktransfer), nullptr);
        const auto& bulk = *reinterpret_cast<usbdevfs_bulktransfer*>(transfer->data);
        UMockdevIoctlData* const bytes = umockdev_ioctl_data_resolve(
            transfer, offsetof(usbdevfs_bulktransfer, data), bulk.len, nullptr);
        round();
        const bool is_taken =
            peer_.out(static_cast<uint8_t>(bulk.ep),
                      {reinterpret_cast<const std::byte*>(bytes->data), bulk.len});
        umockdev_ioctl_client_complete(client, is_taken ? static_cast<glong>(bulk.len) : -1,
                                       is_taken ? 0 : ETIMEDOUT);
        umockdev_ioctl_data_unref(bytes);
        umockdev_ioctl_data_unref(transfer);
        return TRUE;
    }

    void forget() {
        for (std::deque<UMockdevIoctlData*>* all : {&flying_, &done_}) {
            for (UMockdevIoctlData* data : *all)
                umockdev_ioctl_data_unref(data);
            all->clear();
        }
    }

    // One look at everything in flight, in the order of submission.
    void round() {
        peer_.advance(now_ns_());
        for (size_t i = 0; i < flying_.size();) {
            UMockdevIoctlData* const data = flying_[i];
            if (end_one(urb_of(data))) {
                done_.push_back(data);
                flying_.erase(flying_.begin() + static_cast<long>(i));
            } else {
                ++i;
            }
        }
    }
    bool end_one(usbdevfs_urb& urb) {
        constexpr size_t kSetup = 8;
        const auto* in_bytes = static_cast<const uint8_t*>(urb.buffer);
        const std::span bytes(static_cast<std::byte*>(urb.buffer),
                              static_cast<size_t>(urb.buffer_length));
        urb.status = 0;
        if (urb.type == USBDEVFS_URB_TYPE_CONTROL) {
            ++controls;
            const UsbSetup setup{.type = in_bytes[0],
                                 .request = in_bytes[1],
                                 .value = static_cast<uint16_t>(in_bytes[2] | in_bytes[3] << 8),
                                 .index = static_cast<uint16_t>(in_bytes[4] | in_bytes[5] << 8)};
            urb.actual_length = urb.buffer_length - static_cast<int>(kSetup);
            if (!peer_.control(setup, bytes.subspan(kSetup)))
                urb.status = -EPIPE;
            return true;
        }
        if (urb.endpoint & 0x80) {
            const int came = peer_.in(urb.endpoint, bytes);
            if (came < 0)
                return false;
            ++reads;
            urb.actual_length = came;
            return true;
        }
        urb.actual_length = urb.buffer_length;
        if (!peer_.out(urb.endpoint, bytes))
            return false;
        ++writes;
        return true;
    }

    FakePeer& peer_;
    std::function<int64_t()> now_ns_;
    UMockdevTestbed* bed_;
    UMockdevIoctlBase* handler_ = nullptr;
    std::string node_;
    unsigned address_ = 0;
    std::mutex mutex_;
    std::deque<UMockdevIoctlData*> flying_, done_;
};

} // namespace palpate::haptics
